//! The guide for users: every link of the documentation leads somewhere, and mdBook builds it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, ensure};
use mdbook_driver::MDBook;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::project::{root, target};

/// Pages outside of the guide that are checked too.
const PAGES: [&str; 4] = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"];

/// A page: the anchors of its headings, and its links.
#[derive(Default)]
struct Page {
    anchors: BTreeSet<String>,
    links: Vec<String>,
}

/// Checks the links, and builds the guide into `target/guide`.
///
/// # Errors
/// If a link leads nowhere, a page is not in the table of contents, or mdBook fails.
pub(crate) fn check() -> Result<()> {
    let root = root();
    let mut paths: Vec<PathBuf> = PAGES.iter().map(|name| root.join(name)).collect();
    collect(&root.join("docs"), &mut paths)?;
    let mut pages = BTreeMap::new();
    for path in paths {
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        pages.insert(path, Page::parse(&text));
    }
    let mut broken = Vec::new();
    for (path, page) in &pages {
        let wrong = page.links.iter().filter(|link| !resolves(&pages, path, link));
        let name = path.strip_prefix(root).unwrap_or(path).display().to_string();
        broken.extend(wrong.map(|link| format!("  {name}: {link}")));
    }
    ensure!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
    println!("the links of {} pages lead somewhere", pages.len());
    build(root)
}

/// Builds the guide.
fn build(root: &Path) -> Result<()> {
    let folder = target()?.join("guide");
    let mut book = MDBook::load(root.join("docs"))?;
    book.config.build.build_dir.clone_from(&folder);
    book.build()?;
    println!("the guide: {}", folder.join("index.html").display());
    Ok(())
}

/// Collects the pages below a folder.
fn collect(folder: &Path, pages: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, pages)?;
        } else if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
    Ok(())
}

impl Page {
    fn parse(text: &str) -> Self {
        let mut page = Self::default();
        let mut heading: Option<String> = None;
        for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    let anchor = anchor(&heading.take().unwrap_or_default());
                    let numbered = (1..).map(|n| format!("{anchor}-{n}"));
                    let mut names = std::iter::once(anchor.clone()).chain(numbered);
                    page.anchors.extend(names.find(|name| !page.anchors.contains(name)));
                }
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&text);
                    }
                }
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(dest_url.into_string());
                }
                _ => {}
            }
        }
        page
    }
}

/// Anchor of a heading: its letters, digits, hyphens and underscores in lower case, with hyphens in
/// place of spaces.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().flat_map(char::to_lowercase).filter_map(|c| match c {
        ' ' => Some('-'),
        '-' | '_' => Some(c),
        _ => c.is_alphanumeric().then_some(c),
    });
    kept.collect()
}

/// Returns true if a link of a page leads to a file, and to an anchor if it names one. Links to
/// other hosts are not followed.
fn resolves(pages: &BTreeMap<PathBuf, Page>, page: &Path, link: &str) -> bool {
    if link.contains("://") || link.starts_with("mailto:") {
        return true;
    }
    let (file, fragment) = link.split_once('#').unwrap_or((link, ""));
    let place = if file.is_empty() {
        page.to_owned()
    } else {
        normalized(&page.parent().unwrap_or(Path::new("")).join(file))
    };
    place.exists()
        && (fragment.is_empty() || pages.get(&place).is_none_or(|p| p.anchors.contains(fragment)))
}

/// A path without `.` and `..`.
fn normalized(path: &Path) -> PathBuf {
    let mut place = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            other => place.push(other),
        }
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_have_anchors() {
        for (heading, expected) in [
            ("Light groups: `--light-groups`", "light-groups---light-groups"),
            ("IES files", "ies-files"),
            ("Näher, 2 × 3", "näher-2--3"),
        ] {
            assert_eq!(anchor(heading), expected);
        }
    }

    #[test]
    fn links_lead_to_files_and_anchors() {
        let text = "# A b\n\n# A b\n\n[x](#a-b) [y](#a-b-1) [z](#c) [w](CHANGELOG.md) ![v](none.png) \
                    [u](https://example.org)";
        let path = root().join("README.md");
        let pages = BTreeMap::from([(path.clone(), Page::parse(text))]);
        let links = &pages[&path].links;
        let found: Vec<_> = links.iter().map(|link| resolves(&pages, &path, link)).collect();
        assert_eq!(found, [true, true, false, true, false, true]);
    }
}
