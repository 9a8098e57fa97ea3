//! Detection of objects that contain themselves, directly or through others, or are nested too
//! deeply.
//!
//! References make a graph of the objects. Its readers recurse, and read a bsdf once per path that
//! leads to it. The graph is therefore traversed once, without recursion, before any of them runs.

use super::object::{ObjectTree, error};
use crate::LoadError;
use crate::shared::names::quote;

/// Maximum number of bsdfs in a bsdf, each counted once per reference.
const MAX_BSDFS: u64 = 1000;
/// Maximum number of objects of a cycle that a message names.
const MAX_NAMED: usize = 8;

/// State of an object in the traversal.
#[derive(Clone, Copy)]
enum NestingState {
    Nothing,
    /// Being traversed: a reference to it closes a cycle.
    Open,
    Walked(NestingSize),
}

/// Nesting depth and number of bsdfs of an object, including itself.
#[derive(Clone, Copy, Default)]
struct NestingSize {
    /// Nesting depth.
    depth: usize,
    bsdfs: u64,
}

/// An object that is being traversed.
struct TraversalStep {
    index: usize,
    /// Number of children visited.
    seen: usize,
    /// Combined size of the visited children.
    size: NestingSize,
}

/// Marks each object that contains itself or is nested too deeply as broken, and reports it.
///
/// # Errors
/// If there are too many errors to continue.
pub(super) fn check(tree: &mut ObjectTree) -> Result<(), LoadError> {
    let mut found = vec![NestingState::Nothing; tree.objects.len()];
    // The first object is the scene, to which nothing can refer.
    for index in 1..tree.objects.len() {
        if matches!(found[index], NestingState::Nothing) {
            walk(tree, &mut found, index)?;
        }
    }
    Ok(())
}

/// Traverses an object and its unvisited descendants.
fn walk(tree: &mut ObjectTree, found: &mut [NestingState], start: usize) -> Result<(), LoadError> {
    let mut next = Some(start);
    let mut open: Vec<TraversalStep> = Vec::new();
    loop {
        if let Some(index) = next.take() {
            found[index] = NestingState::Open;
            open.push(TraversalStep { index, seen: 0, size: NestingSize::default() });
        }
        let Some(step) = open.last_mut() else { return Ok(()) };
        let Some(child) = tree.objects[step.index].children.get(step.seen) else {
            let (index, size) = (step.index, step.size);
            open.pop();
            found[index] = NestingState::Walked(whole(tree, index, size)?);
            continue;
        };
        // Broken objects were reported. Unknown identifiers are reported by the reader of the
        // object.
        let Ok(target) = tree.target(child) else {
            step.seen += 1;
            continue;
        };
        match found[target] {
            NestingState::Nothing => next = Some(target),
            NestingState::Open => {
                let way = open.iter().skip_while(|step| step.index != target).skip(1);
                let way: Vec<_> = way.map(|step| tree.objects[step.index].name()).collect();
                let message = circle(tree.objects[target].name(), &way);
                let (refusal, broken) = (error(&child.at, message), open.len() - 1);
                refuse(tree, open[broken].index, refusal)?;
                open[broken].seen = usize::MAX; // one report for each object
            }
            NestingState::Walked(NestingSize { depth, bsdfs }) => {
                step.seen += 1;
                step.size.depth = step.size.depth.max(depth);
                step.size.bsdfs = step.size.bsdfs.saturating_add(bsdfs);
            }
        }
    }
}

/// Computes the size of an object from that of its children; zero if it is rejected.
fn whole(
    tree: &mut ObjectTree,
    index: usize,
    children: NestingSize,
) -> Result<NestingSize, LoadError> {
    let object = &tree.objects[index];
    let is_bsdf = object.tag == "bsdf";
    let depth = children.depth + 1;
    let bsdfs = children.bsdfs.saturating_add(1);
    let most = tree.context.limits().depth(MAX_DEPTH);
    let message = if depth > most {
        format!("objects, including referenced ones, are nested deeper than {most}")
    } else if is_bsdf && bsdfs > MAX_BSDFS {
        format!("more than {MAX_BSDFS} nested bsdfs, each counted as often as it is used")
    } else {
        return Ok(NestingSize { depth, bsdfs: if is_bsdf { bsdfs } else { 0 } });
    };
    let refusal = error(&object.at, message);
    refuse(tree, index, refusal)?;
    Ok(NestingSize::default())
}

/// Reports an error of an object and marks it as broken, so that it is not read.
fn refuse(tree: &mut ObjectTree, index: usize, refusal: LoadError) -> Result<(), LoadError> {
    tree.context.ok_or_report::<()>(Err(refusal))?;
    tree.objects[index].is_broken = true;
    Ok(())
}

/// Message about an object that contains itself through others.
fn circle(name: &str, way: &[&str]) -> String {
    let named: Vec<_> = way.iter().take(MAX_NAMED).map(|name| quote(name)).collect();
    let by = match (named.as_slice(), way.len()) {
        ([], _) => String::new(),
        (named, count) if count > MAX_NAMED => {
            format!(" through {} and {} others", named.join(", "), count - MAX_NAMED)
        }
        (named, _) => format!(" through {}", named.join(", ")),
    };
    format!("{} contains itself{by}; reference another object", quote(name))
}

/// Maximum nesting depth of objects, including referenced ones.
pub(super) const MAX_DEPTH: usize = 64;
