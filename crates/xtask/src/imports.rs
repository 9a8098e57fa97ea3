//! Imports between the modules of each crate: no circles of files or of folders, and only those
//! imports between folders that `imports.txt` allows.
//!
//! A file may name items of its parent modules, and a parent those of its children, without making
//! a circle. Names that a module imports stand for the items themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use syn::visit::Visit;
use syn::{ItemMod, ItemUse, UseTree};

use crate::project::root;

/// File of the imports that are allowed, beside this one.
const ALLOWED: &str = "crates/xtask/src/imports.txt";

/// Environment variable that has the file of allowed imports written anew.
const WRITE: &str = "PT_WRITE_EXPECTED";

/// Path of a module in its crate; the root is empty.
type Module = Vec<String>;

/// Modules of a crate, and the modules whose items each names.
type Graph = BTreeMap<Module, BTreeSet<Module>>;

/// Checks the imports of all crates.
///
/// # Errors
/// If files or folders import each other in a circle, or a folder imports from one that is not
/// allowed.
pub(crate) fn check() -> Result<()> {
    let mut folders = String::new();
    let mut circles = Vec::new();
    for (name, source) in crates()? {
        let modules = parse(&source)?;
        let graph = graph(&modules);
        for circle in circles_of(&graph) {
            circles.push(format!("  {name}: {}", shown(&circle, &graph)));
        }
        let between = folders_of(&graph);
        let by_folder = graph_of_folders(&between);
        for circle in circles_of(&by_folder) {
            circles.push(format!("  {name}: {}", shown(&circle, &by_folder)));
        }
        for (folder, used) in between {
            write!(folders, "{name}/{folder}:")?;
            used.iter().try_for_each(|other| write!(folders, " {other}"))?;
            writeln!(folders)?;
        }
    }
    println!("{} circles of files or folders that import each other", circles.len());
    ensure!(
        circles.is_empty(),
        "files or folders import each other; move what they share into one that both may import:\n{}",
        circles.join("\n")
    );
    let path = root().join(ALLOWED);
    if std::env::var_os(WRITE).is_some() {
        fs::write(&path, &folders).with_context(|| path.display().to_string())?;
    }
    let allowed = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    compare(&folders, &allowed)
}

/// Compares the imports between folders with those allowed.
fn compare(found: &str, allowed: &str) -> Result<()> {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<BTreeSet<_>>();
    let (found, allowed) = (lines(found), lines(allowed));
    let new: Vec<_> = found.difference(&allowed).map(|line| format!("  + {line}")).collect();
    let old: Vec<_> = allowed.difference(&found).map(|line| format!("  - {line}")).collect();
    if new.is_empty() && old.is_empty() {
        return Ok(());
    }
    bail!(
        "imports between folders differ from {ALLOWED}; remove the import, or, if the folder should \
         depend on the other, change that line:\n{}",
        [new, old].concat().join("\n")
    )
}

/// Names and source folders of the crates.
fn crates() -> Result<Vec<(String, std::path::PathBuf)>> {
    let folder = root().join("crates");
    let mut all = Vec::new();
    for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        all.push((entry.file_name().to_string_lossy().into_owned(), entry.path().join("src")));
    }
    all.sort();
    Ok(all)
}

/// Names that a file imports or uses with a path, by the modules in which they are written.
#[derive(Default)]
struct ModuleNames {
    /// Names that `use` brings into scope, with the paths for which they stand.
    imported: Vec<(String, Vec<String>)>,
    /// Paths elsewhere in the code.
    used: Vec<Vec<String>>,
    /// Depth of modules inside of the file.
    depth: usize,
}

impl ModuleNames {
    /// Removes a `super` for each module inside of the file; `None` if the path stays in the file.
    fn outside(&self, path: &[String]) -> Option<Vec<String>> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        if self.depth == 0 || path.first().is_some_and(|name| name == "crate") {
            return Some(path.to_vec());
        }
        (ups > self.depth).then(|| path[self.depth..].to_vec())
    }

    fn import(&mut self, tree: &UseTree, mut path: Vec<String>) {
        let (name, last) = match tree {
            UseTree::Path(inner) => {
                path.push(inner.ident.to_string());
                return self.import(&inner.tree, path);
            }
            UseTree::Group(group) => {
                return group.items.iter().for_each(|item| self.import(item, path.clone()));
            }
            UseTree::Name(name) => (name.ident.to_string(), name.ident.to_string()),
            UseTree::Rename(rename) => (rename.rename.to_string(), rename.ident.to_string()),
            UseTree::Glob(_) => ("*".to_owned(), "*".to_owned()),
        };
        let name = match path.last() {
            Some(module) if last == "self" && name == "self" => module.clone(),
            _ => name,
        };
        if last != "self" && last != "*" {
            path.push(last);
        }
        if let Some(path) = self.outside(&path) {
            self.imported.push((name, path));
        }
    }
}

impl<'ast> Visit<'ast> for ModuleNames {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.import(&item.tree, Vec::new());
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        let is_test = item.attrs.iter().any(|attribute| {
            attribute.path().is_ident("cfg")
                && attribute.meta.require_list().is_ok_and(|m| m.tokens.to_string() == "test")
        });
        if !is_test {
            self.depth += 1;
            syn::visit::visit_item_mod(self, item);
            self.depth -= 1;
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<_> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1
            && let Some(names) = self.outside(&names)
        {
            self.used.push(names);
        }
        syn::visit::visit_path(self, path);
    }
}

/// Parses the files below a folder of sources.
fn parse(source: &Path) -> Result<BTreeMap<Module, ModuleNames>> {
    let mut modules = BTreeMap::new();
    let mut folders = vec![source.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = fs::read_to_string(&path)?;
                let file = syn::parse_file(&text).with_context(|| path.display().to_string())?;
                let mut names = ModuleNames::default();
                names.visit_file(&file);
                modules.insert(module_of(path.strip_prefix(source)?), names);
            }
        }
    }
    Ok(modules)
}

/// Module of a file, from its path below the folder of sources.
fn module_of(path: &Path) -> Module {
    let stem = path.with_extension("");
    let mut module: Module = stem.iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if module.last().is_some_and(|name| ["mod", "lib", "main"].contains(&name.as_str())) {
        module.pop();
    }
    module
}

/// Absolute path in the crate of a path that is written in a module; `None` if it is outside.
fn absolute(
    modules: &BTreeMap<Module, ModuleNames>,
    module: &Module,
    path: &[String],
) -> Option<Vec<String>> {
    let child = || [module, &path[..1]].concat();
    match path.first()?.as_str() {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([module, &path[1..]].concat()),
        "super" => {
            let ups = path.iter().take_while(|name| *name == "super").count();
            let base = module.len().checked_sub(ups)?;
            Some([&module[..base], &path[ups..]].concat())
        }
        _ if modules.contains_key(&child()) => Some([module, path].concat()),
        _ => None,
    }
}

/// Module that defines the item of an absolute path: imported names are followed.
fn definition(
    modules: &BTreeMap<Module, ModuleNames>,
    path: &[String],
    depth: usize,
) -> Option<Module> {
    const MAX_DEPTH: usize = 16;
    let length = (0..=path.len()).rev().find(|n| modules.contains_key(&path[..*n]))?;
    let (module, rest) = path.split_at(length);
    let module = module.to_vec();
    let imported = rest.first().and_then(|name| {
        let known = modules[&module].imported.iter().find(|(known, _)| known == name)?;
        absolute(modules, &module, &known.1)
    });
    match imported {
        Some(target) if depth < MAX_DEPTH => {
            definition(modules, &[&target, &rest[1..]].concat(), depth + 1)
        }
        _ => Some(module),
    }
}

/// Modules whose items each module of a crate names.
fn graph(modules: &BTreeMap<Module, ModuleNames>) -> Graph {
    let targets = |module: &Module, names: &ModuleNames| {
        let imported = names.imported.iter().map(|(_, path)| path);
        let paths = imported.chain(&names.used);
        let absolute = paths.filter_map(|path| absolute(modules, module, path));
        let mut all: BTreeSet<_> =
            absolute.filter_map(|path| definition(modules, &path, 0)).collect();
        all.remove(module);
        all
    };
    modules.iter().map(|(module, names)| (module.clone(), targets(module, names))).collect()
}

/// Imports from modules that are not parents.
fn from_others<'g>(graph: &'g Graph, module: &'g Module) -> impl Iterator<Item = &'g Module> {
    graph[module].iter().filter(|other| !module.starts_with(other))
}

/// Groups of modules each of which reaches the others through imports from modules that are not its
/// parents.
fn circles_of(graph: &Graph) -> Vec<BTreeSet<Module>> {
    let reached = |from: &Module| {
        let mut found = BTreeSet::new();
        let mut open: Vec<&Module> = from_others(graph, from).collect();
        while let Some(module) = open.pop() {
            if found.insert(module.clone()) {
                open.extend(from_others(graph, module));
            }
        }
        found
    };
    let all: BTreeMap<_, _> = graph.keys().map(|module| (module, reached(module))).collect();
    let mut circles: Vec<BTreeSet<Module>> = Vec::new();
    for (module, reached) in &all {
        if reached.contains(*module) && !circles.iter().any(|circle| circle.contains(*module)) {
            let back = reached.iter().filter(|other| all[other].contains(*module));
            circles.push(back.cloned().collect());
        }
    }
    circles
}

/// The imports within a circle.
fn shown(circle: &BTreeSet<Module>, graph: &Graph) -> String {
    let name = |module: &Module| module.join("/");
    let line = |module: &Module| {
        let used: Vec<_> =
            from_others(graph, module).filter(|other| circle.contains(*other)).map(name).collect();
        format!("{} -> {}", name(module), used.join(" "))
    };
    circle.iter().map(line).collect::<Vec<_>>().join("; ")
}

/// Folders directly below the root of a crate, with the folders whose items they name.
fn folders_of(graph: &Graph) -> BTreeMap<String, BTreeSet<String>> {
    let is_folder = |name: &String| graph.keys().any(|m| m.len() > 1 && m[0] == *name);
    let mut folders = BTreeMap::<String, BTreeSet<String>>::new();
    for (module, used) in graph {
        let Some(folder) = module.first().filter(|name| is_folder(name)) else { continue };
        let others = used.iter().filter_map(|other| other.first());
        let others = others.filter(|other| *other != folder && is_folder(other)).cloned();
        folders.entry(folder.clone()).or_default().extend(others);
    }
    folders
}

/// The folders as modules.
fn graph_of_folders(folders: &BTreeMap<String, BTreeSet<String>>) -> Graph {
    let module = |folder: &String| vec![folder.clone()];
    folders
        .iter()
        .map(|(folder, used)| (module(folder), used.iter().map(module).collect()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modules(files: &[(&str, &str)]) -> BTreeMap<Module, ModuleNames> {
        let parse = |(path, text): &(&str, &str)| {
            let mut names = ModuleNames::default();
            names.visit_file(&syn::parse_file(text).expect("valid code"));
            (module_of(Path::new(path)), names)
        };
        files.iter().map(parse).collect()
    }

    fn circles(files: &[(&str, &str)]) -> Vec<String> {
        let graph = graph(&modules(files));
        circles_of(&graph).iter().map(|circle| shown(circle, &graph)).collect()
    }

    #[test]
    fn files_that_import_each_other_are_a_circle() {
        let files = [("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::B;")];
        let with = |b| circles(&[files[0], files[1], ("b.rs", b)]);
        assert_eq!(with("use std::fmt;"), [""; 0]);
        for b in
            ["use super::a::A;", "fn f() { crate::a::g() }", "use super::*; use crate::a as x;"]
        {
            assert_eq!(with(b), ["a -> b; b -> a"], "{b}");
        }
        assert_eq!(with("#[cfg(test)] mod tests { use crate::a::A; }"), [""; 0]);
    }

    #[test]
    fn parents_and_children_are_none_but_names_of_parents_are_followed() {
        let parent = ("a/mod.rs", "mod x; mod y; pub use x::X; pub trait T {}");
        let files = |x, y| circles(&[("lib.rs", "mod a;"), parent, ("a/x.rs", x), ("a/y.rs", y)]);
        assert_eq!(files("use super::T;", "use super::{T, X};"), [""; 0]);
        assert_eq!(files("use super::y::Y;", "use super::X;"), ["a/x -> a/y; a/y -> a/x"]);
    }

    #[test]
    fn modules_inside_of_a_file_belong_to_it() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "mod inner { use super::f; use super::super::b::B; }"),
            ("b.rs", "use crate::a;"),
        ];
        assert_eq!(circles(&files), ["a -> b; b -> a"]);
    }

    #[test]
    fn folders_that_import_each_other_through_different_files_are_a_circle() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a/mod.rs", "mod x; pub mod y;"),
            ("a/x.rs", "use crate::b::x::B;"),
            ("a/y.rs", ""),
            ("b/mod.rs", "pub mod x; mod y;"),
            ("b/x.rs", ""),
            ("b/y.rs", "use crate::a::y::A;"),
        ];
        assert_eq!(circles(&files), [""; 0]);
        let folders = graph_of_folders(&folders_of(&graph(&modules(&files))));
        let circles: Vec<_> = circles_of(&folders).iter().map(|c| shown(c, &folders)).collect();
        assert_eq!(circles, ["a -> b; b -> a"]);
    }

    #[test]
    fn imports_between_folders_are_listed() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a/mod.rs", "mod x;"),
            ("a/x.rs", "use crate::b::y::Y; use crate::c::C;"),
            ("b/mod.rs", "pub mod y;"),
            ("b/y.rs", ""),
            ("c.rs", ""),
        ];
        let folders = folders_of(&graph(&modules(&files)));
        assert!(circles_of(&graph_of_folders(&folders)).is_empty());
        let names: Vec<_> =
            folders.into_iter().map(|(f, used)| (f, Vec::from_iter(used))).collect();
        assert_eq!(names, [("a".into(), vec!["b".into()]), ("b".into(), Vec::<String>::new())]);
        assert!(compare("x/a: b\n", "x/a: b\n").is_ok());
        assert!(compare("x/a: b\n", "x/a: \n").unwrap_err().to_string().contains("+ x/a: b"));
    }
}
