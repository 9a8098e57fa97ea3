//! What several things refer to by a name: tables of meshes, points, images, textures, grids,
//! profiles, measurements and motions; and
//! materials and media, which a scene numbers.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};

use super::super::context::Context;
use super::codec::{FieldCodec, JsonCodec};
use super::node::{Keys, Node};
use super::printer::{Entries, Out};
use super::schema::Schemas;
use crate::image::Image;
use crate::light::IesProfile;
use crate::measured::Measurements;
use crate::medium::Grid;
use crate::{LoadError, Mesh, Motion, Points, Texture};

/// What is known while a file is read.
pub(super) struct JsonReader<'a> {
    /// The folder from which paths go on.
    pub(super) folder: &'a Path,
    pub(super) context: &'a Context,
    /// The name of the entry of a table that is read, which it has if it gives no other.
    pub(super) key: String,
    /// Width over height of the image, for cameras that give one angle.
    pub(super) aspect: f64,
    pub(super) materials: HashMap<String, u32>,
    pub(super) media: HashMap<String, u32>,
    pub(super) tables: Tables,
    /// Files that were read, by what they became.
    pub(super) files: Files,
    /// Entries of tables that have an error, or a file that is missing: the name of the table, and
    /// theirs.
    failed: HashSet<(&'static str, String)>,
}

/// The entries of each table.
#[derive(Default)]
pub(super) struct Tables {
    pub(super) meshes: HashMap<String, Arc<Mesh>>,
    pub(super) points: HashMap<String, Arc<Points>>,
    pub(super) images: HashMap<String, Arc<Image>>,
    pub(super) textures: HashMap<String, Arc<Texture>>,
    pub(super) grids: HashMap<String, Arc<Grid>>,
    pub(super) profiles: HashMap<String, Arc<IesProfile>>,
    pub(super) measurements: HashMap<String, Arc<Measurements>>,
    pub(super) motions: HashMap<String, Arc<Motion>>,
}

/// Each file is read once for each use.
#[derive(Default)]
pub(super) struct Files {
    pub(super) meshes: HashMap<(PathBuf, String), Arc<Mesh>>,
    pub(super) points: HashMap<PathBuf, Arc<Points>>,
    pub(super) images: HashMap<(PathBuf, bool), Arc<Image>>,
    pub(super) grids: HashMap<PathBuf, Arc<Grid>>,
    pub(super) profiles: HashMap<PathBuf, Arc<IesProfile>>,
    /// Bytes in memory so far.
    bytes: u64,
}

impl<'a> JsonReader<'a> {
    pub(super) fn new(folder: &'a Path, context: &'a Context) -> Self {
        Self {
            folder,
            context,
            key: String::new(),
            aspect: 1.0,
            materials: HashMap::new(),
            media: HashMap::new(),
            tables: Tables::default(),
            files: Files::default(),
            failed: HashSet::new(),
        }
    }

    /// Notes that an entry of a table cannot be used, and that this was told.
    pub(super) fn fail(&mut self, table: &'static str, name: &str) {
        self.failed.insert((table, name.to_owned()));
    }

    /// The error about a name that is not in a table, which is called so as one of its entries.
    fn unknown<T>(
        &self,
        node: &Node<'_>,
        (table, what): (&'static str, &str),
        name: &str,
        known: &HashMap<String, T>,
    ) -> LoadError {
        if self.failed.contains(&(table, name.to_owned())) {
            return LoadError::AlreadyReported;
        }
        node.unknown(what, name, sorted(known).into_iter())
    }

    /// Reads a file that the scene names.
    pub(super) fn read(&self, path: &Path, node: &Node<'_>) -> Result<Vec<u8>, LoadError> {
        self.context.read(path).map_err(|message| node.error(message))
    }

    /// Counts what files become in memory.
    ///
    /// # Errors
    /// If that is more than any scene should take.
    pub(super) fn account(&mut self, bytes: usize, node: &Node<'_>) -> Result<(), LoadError> {
        const MAX_BYTES: u64 = 1 << 35;
        self.files.bytes = self.files.bytes.saturating_add(bytes as u64);
        if self.files.bytes <= MAX_BYTES {
            return Ok(());
        }
        Err(node.error("with this file, meshes, images and grids take more than 32 GiB"))
    }

    /// The path of a file that the scene names.
    pub(super) fn path(&self, node: &Node<'_>) -> Result<PathBuf, LoadError> {
        let name = node.text().filter(|name| !name.is_empty());
        Ok(self.folder.join(name.ok_or_else(|| node.unexpected("the path of a file"))?))
    }
}

/// A file to be written beside the scene.
pub(super) struct OutFile {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
}

/// What is known while a file is written.
#[derive(Default)]
pub(super) struct JsonWriter<'a> {
    /// The folder of files beside the scene, as the scene calls it.
    pub(super) folder: String,
    /// See [`JsonReader::key`].
    pub(super) key: String,
    pub(super) materials: &'a [String],
    pub(super) media: &'a [String],
    /// Entries of each table, in the order in which they are needed.
    pub(super) tables: HashMap<&'static str, Entries>,
    pub(super) files: Vec<OutFile>,
    /// The names of what is in tables, by where it is in memory.
    names: HashMap<(&'static str, usize), String>,
    taken: HashMap<&'static str, Unique>,
}

impl<'a> JsonWriter<'a> {
    /// For a scene with these names of materials and media.
    pub(super) fn new(folder: String, materials: &'a [String], media: &'a [String]) -> Self {
        Self { folder, materials, media, ..Self::default() }
    }

    /// Has a file written beside the scene, and gives its path.
    pub(super) fn file(&mut self, name: &str, ending: &str, bytes: Vec<u8>) -> Out {
        let is_safe = |c: char| c.is_alphanumeric() || "-_".contains(c);
        let safe: String =
            name.chars().map(|c| if is_safe(c) { c } else { '_' }).take(60).collect();
        let stem = self.taken.entry("files").or_default().name(&safe.to_lowercase(), "file");
        let name = format!("{stem}.{ending}");
        let path = format!("{}/{name}", self.folder);
        self.files.push(OutFile { name, bytes });
        Out::Text(path)
    }
}

/// Gives names of which no two are the same.
#[derive(Default)]
pub(super) struct Unique(HashSet<String>, HashMap<String, usize>);

impl Unique {
    /// This name or, if it is taken, with a number; if it is empty, the other one.
    pub(super) fn name(&mut self, wanted: &str, otherwise: &str) -> String {
        let wanted = if wanted.is_empty() { otherwise } else { wanted };
        let mut name = wanted.to_owned();
        let count = self.1.entry(wanted.to_owned()).or_insert(1);
        while !self.0.insert(name.clone()) {
            *count += 1;
            name = format!("{wanted}_{count}");
        }
        name
    }
}

/// What stands in a table, and is referred to by its name; or stands where it is used.
pub(super) trait Shared: Sized {
    /// The key of the table, and what one of its entries is called.
    const TABLE: (&'static str, &'static str);

    fn table(tables: &mut Tables) -> &mut HashMap<String, Arc<Self>>;
    /// Told what the table holds before the first of it is read.
    fn look_ahead(_entries: &[(&str, Node<'_>)], _cx: &JsonReader<'_>) {}
    /// What stands behind a name, or in the place of one.
    fn read_entry(node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError>;
    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema_of_entry(schemas: &mut Schemas) -> Value;
    /// The name that it wants to have.
    fn name(&self) -> &str {
        Self::TABLE.1
    }
}

impl<T: Shared> JsonCodec for Arc<T> {
    fn read(node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let Some(name) = node.text() else {
            cx.key.clear();
            return T::read_entry(node, cx);
        };
        if let Some(found) = T::table(&mut cx.tables).get(name) {
            return Ok(Arc::clone(found));
        }
        let table = std::mem::take(T::table(&mut cx.tables));
        let error = cx.unknown(node, T::TABLE, name, &table);
        *T::table(&mut cx.tables) = table;
        Err(error)
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let (table, _) = T::TABLE;
        let place = (table, Arc::as_ptr(self) as usize);
        if let Some(name) = cx.names.get(&place) {
            return Ok(Out::text(name));
        }
        let name = cx.taken.entry(table).or_default().name(self.name(), T::TABLE.1);
        let around = std::mem::replace(&mut cx.key, name.clone());
        let entry = self.write_entry(cx).map_err(|e| format!("{table}.{name}: {e}"))?;
        cx.key = around;
        cx.tables.entry(table).or_default().push((name.clone(), entry));
        cx.names.insert(place, name.clone());
        Ok(Out::Text(name))
    }

    fn schema(schemas: &mut Schemas) -> Value {
        json!({"anyOf": [{"type": "string"}, T::schema_of_entry(schemas)]})
    }
}

/// Reads a table; what stands in it may refer to what stands before.
pub(super) fn read_table<T: Shared>(
    root: &mut Keys<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<(), LoadError> {
    let Some(node) = root.take(T::TABLE.0) else { return Ok(()) };
    let entries = node.entries()?;
    T::look_ahead(&entries, cx);
    for (name, node) in entries {
        name.clone_into(&mut cx.key);
        let read = T::read_entry(&node, cx);
        match cx.context.ok_or_report(read)? {
            Some(entry) => drop(T::table(&mut cx.tables).insert(name.to_owned(), entry)),
            None => cx.fail(T::TABLE.0, name),
        }
    }
    Ok(())
}

fn sorted<T>(table: &HashMap<String, T>) -> Vec<&str> {
    let mut names: Vec<_> = table.keys().map(String::as_str).collect();
    names.sort_unstable();
    names
}

/// The name of an entry: that by which it is referred to, if there is no other.
pub(super) struct Name;

impl FieldCodec<String> for Name {
    const IS_NEEDED: bool = false;

    fn read(&self, node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<String, LoadError> {
        String::read(node, cx)
    }

    fn write(&self, value: &String, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::text(value))
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": "string"})
    }

    fn missing(&self, _: &Node<'_>, cx: &JsonReader<'_>) -> Option<String> {
        Some(cx.key.clone())
    }

    fn is_understood(&self, value: &String, cx: &JsonWriter<'_>) -> bool {
        *value == cx.key
    }
}

/// A material or a medium, by the name of its entry.
#[derive(Clone, Copy)]
pub(super) enum Numbered {
    Material,
    Medium,
}

impl Numbered {
    fn what(self) -> &'static str {
        match self {
            Self::Material => "material",
            Self::Medium => "medium",
        }
    }
}

impl FieldCodec<Option<u32>> for Numbered {
    fn read(&self, node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<Option<u32>, LoadError> {
        if node.value().as_null_keyword().is_some() {
            return Ok(None);
        }
        let (key, table) = match self {
            Self::Material => ("materials", &cx.materials),
            Self::Medium => ("media", &cx.media),
        };
        let what = self.what();
        let name = node.text().ok_or_else(|| node.unexpected(&format!("the name of a {what}")))?;
        let index = table.get(name).copied();
        index.map(Some).ok_or_else(|| cx.unknown(node, (key, what), name, table))
    }

    fn write(&self, value: &Option<u32>, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let Some(index) = *value else { return Ok(Out::Null) };
        let names = match self {
            Self::Material => cx.materials,
            Self::Medium => cx.media,
        };
        let name = names.get(index as usize);
        name.map(Out::text).ok_or_else(|| format!("there is no {} {index}", self.what()))
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": ["string", "null"]})
    }
}
