//! Objects that contain themselves, directly or through others, and those nested too deeply.
//!
//! References make a graph of the objects. Its readers recurse, and read a bsdf once for every way
//! that leads to it; so the graph is walked once, without recursion, before any of them runs.

use super::super::xml::quote;
use super::object::{Tree, error};
use super::read::MAX_DEPTH;
use crate::LoadError;

/// Most bsdfs that one bsdf is made of, each counted as often as it is referred to.
const MAX_BSDFS: u64 = 1000;
/// Most objects of a circle that a message names.
const MAX_NAMED: usize = 8;

/// What was found about an object.
#[derive(Clone, Copy)]
enum Found {
    Nothing,
    /// It is being walked: who refers to it now is inside of it.
    Open,
    Walked(Size),
}

/// What an object contains, itself included.
#[derive(Clone, Copy, Default)]
struct Size {
    /// How deep objects are nested.
    depth: usize,
    bsdfs: u64,
}

/// An object that is being walked.
struct Step {
    index: usize,
    /// Number of children visited.
    seen: usize,
    /// The size of those.
    size: Size,
}

/// Marks each object that contains itself, or is nested too deeply, as broken, and reports it.
///
/// # Errors
/// If there are too many errors to go on.
pub(super) fn check(tree: &mut Tree) -> Result<(), LoadError> {
    let mut found = vec![Found::Nothing; tree.objects.len()];
    // The scene itself is the first object, and nothing can refer to it.
    for index in 1..tree.objects.len() {
        if matches!(found[index], Found::Nothing) {
            walk(tree, &mut found, index)?;
        }
    }
    Ok(())
}

/// Walks an object and all in it that was not walked before.
fn walk(tree: &mut Tree, found: &mut [Found], start: usize) -> Result<(), LoadError> {
    let mut next = Some(start);
    let mut open: Vec<Step> = Vec::new();
    loop {
        if let Some(index) = next.take() {
            found[index] = Found::Open;
            open.push(Step { index, seen: 0, size: Size::default() });
        }
        let Some(step) = open.last_mut() else { return Ok(()) };
        let Some(child) = tree.objects[step.index].children.get(step.seen) else {
            let (index, size) = (step.index, step.size);
            open.pop();
            found[index] = Found::Walked(whole(tree, index, size)?);
            continue;
        };
        // What is broken was reported; unknown identifiers are, by the reader of the object.
        let Ok(target) = tree.target(child) else {
            step.seen += 1;
            continue;
        };
        match found[target] {
            Found::Nothing => next = Some(target),
            Found::Open => {
                let way = open.iter().skip_while(|step| step.index != target).skip(1);
                let way: Vec<_> = way.map(|step| tree.objects[step.index].name()).collect();
                let message = circle(tree.objects[target].name(), &way);
                let (refusal, broken) = (error(&child.at, message), open.len() - 1);
                refuse(tree, open[broken].index, refusal)?;
                open[broken].seen = usize::MAX; // one report for each object
            }
            Found::Walked(Size { depth, bsdfs }) => {
                step.seen += 1;
                step.size.depth = step.size.depth.max(depth);
                step.size.bsdfs = step.size.bsdfs.saturating_add(bsdfs);
            }
        }
    }
}

/// The size of an object by that of its children; none if it is refused.
fn whole(tree: &mut Tree, index: usize, children: Size) -> Result<Size, LoadError> {
    let object = &tree.objects[index];
    let is_bsdf = object.tag == "bsdf";
    let depth = children.depth + 1;
    let bsdfs = children.bsdfs.saturating_add(1);
    let most = tree.context.limits().depth(MAX_DEPTH);
    let message = if depth > most {
        format!("with those that it refers to, objects are nested deeper than {most}")
    } else if is_bsdf && bsdfs > MAX_BSDFS {
        format!("it is made of more than {MAX_BSDFS} bsdfs, each counted as often as it is used")
    } else {
        return Ok(Size { depth, bsdfs: if is_bsdf { bsdfs } else { 0 } });
    };
    let refusal = error(&object.at, message);
    refuse(tree, index, refusal)?;
    Ok(Size::default())
}

/// Reports what is wrong with an object, which is then read by nobody.
fn refuse(tree: &mut Tree, index: usize, refusal: LoadError) -> Result<(), LoadError> {
    tree.context.ok_or_report::<()>(Err(refusal))?;
    tree.objects[index].is_broken = true;
    Ok(())
}

/// What to say of an object that contains itself by way of others.
fn circle(name: &str, way: &[&str]) -> String {
    let named: Vec<_> = way.iter().take(MAX_NAMED).map(|name| quote(name)).collect();
    let by = match (named.as_slice(), way.len()) {
        ([], _) => String::new(),
        (named, count) if count > MAX_NAMED => {
            format!(" by way of {} and {} others", named.join(", "), count - MAX_NAMED)
        }
        (named, _) => format!(" by way of {}", named.join(", ")),
    };
    format!("{} contains itself{by}; refer to another object", quote(name))
}
