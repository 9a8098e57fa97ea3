//! Edited scenes: changes as values of Python, and parts of scenes as such values.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pathtracer::{LoadOptions, Scene as Written, SourceFile, suggestions};
use pt_cli::SceneOrigin;
use pt_math::DAffine3;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors::{internal, unknown_keyword};
use crate::places::Places;
use crate::queries::array;
use crate::reading::Reading;
use crate::source::SceneSource;
use crate::values;

/// Keywords of an edit; the tables are for names in the other parts.
const KEYS: [&str; 14] = [
    "camera",
    "grids",
    "images",
    "lights",
    "materials",
    "measurements",
    "meshes",
    "motions",
    "points",
    "profiles",
    "settings",
    "textures",
    "transforms",
    "used_camera",
];

/// Options of reading the parts of an edit.
const OPTIONS: [&str; 4] = ["allow_folders", "allow_outside", "limits", "strict"];

/// Numbers of the items that an edit replaces.
struct Replaced {
    materials: Vec<usize>,
    /// `None` if the list replaces all lights.
    lights: Option<Vec<usize>>,
    transforms: Vec<usize>,
    /// Active camera, if the edit names one.
    used_camera: Option<usize>,
}

/// Returns the scene with other parts, which refer to files of a folder.
pub(crate) fn replaced(
    source: &SceneSource,
    folder: &Path,
    changes: &Bound<'_, PyDict>,
) -> PyResult<SceneSource> {
    let py = changes.py();
    let (parts, options) = sorted(changes)?;
    let scene = &*source.scene;
    let used_camera = taken(&parts, "used_camera")?;
    let used_camera = used_camera
        .map(|key| number("used_camera", &key, &names(&scene.cameras, |camera| &camera.name)));
    let used_camera = used_camera.transpose()?;
    let stub = Written {
        settings: scene.settings.clone(),
        metres_per_unit: scene.metres_per_unit,
        ..Written::default()
    };
    let media = pathtracer::names_of(scene).1;
    let arguments = (parts, values::to_python(py, &stub)?, media);
    let made = py.import("pathtracer._edits")?.call_method1("values", arguments)?;
    let (of_edit, places, keys): (Bound<'_, PyDict>, Vec<(String, String)>, Bound<'_, PyDict>) =
        made.extract()?;
    let replaced = Replaced { used_camera, ..Replaced::find(scene, &keys)? };
    let places = Places::new(places);
    let reading = Reading::new(Some(&options))?;
    let text = values::of_python(&of_edit, &places)?;
    let hash = pathtracer::source_file(Path::new(""), text.text.as_bytes()).hash;
    let (read, of_files) = reading.values(py, text, folder, &places)?;
    let edited = replaced.apply(scene, read, changes)?;
    let hash = used_camera.map_or_else(|| hash.clone(), |used| format!("{hash}, camera {used}"));
    let has_camera = used_camera.is_some() || is_given(changes, "camera")?;
    let origin = origin(&source.origin, of_files, &hash, has_camera);
    Ok(source.edited(edited, origin))
}

/// Parts and options of an edit.
fn sorted<'py>(changes: &Bound<'py, PyDict>) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let (parts, options) = (PyDict::new(changes.py()), PyDict::new(changes.py()));
    for (name, value) in changes {
        let name: String = name.extract()?;
        let is_option = OPTIONS.contains(&name.as_str());
        if !is_option && !KEYS.contains(&name.as_str()) {
            return Err(unknown_keyword(&name, &KEYS, &OPTIONS));
        }
        if !value.is_none() {
            (if is_option { &options } else { &parts }).set_item(name, value)?;
        }
    }
    Ok((parts, options))
}

/// Removes an argument, and returns it.
fn taken<'py>(parts: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    let value = parts.get_item(name)?;
    if value.is_some() {
        parts.del_item(name)?;
    }
    Ok(value)
}

impl Replaced {
    fn find(scene: &Written, keys: &Bound<'_, PyDict>) -> PyResult<Self> {
        let of = |table: &'static str, names: &[String]| -> PyResult<Vec<usize>> {
            let keys: Vec<Bound<'_, PyAny>> = keys.as_any().get_item(table)?.extract()?;
            keys.iter().map(|key| number(table, key, names)).collect()
        };
        let lights = if keys.as_any().get_item("lights")?.is_none() {
            None
        } else {
            Some(of("lights", &names(&scene.lights, |light| &light.name))?)
        };
        Ok(Self {
            materials: of("materials", &pathtracer::names_of(scene).0)?,
            lights,
            transforms: of("transforms", &names(&scene.objects, |object| &object.name))?,
            used_camera: None,
        })
    }

    /// The scene with the items of another one.
    fn apply(
        self,
        scene: &Written,
        read: Written,
        changes: &Bound<'_, PyDict>,
    ) -> PyResult<Written> {
        let mut edited = scene.clone();
        if let Some(used) = self.used_camera {
            edited.used_camera = Some(used as u32);
        }
        if let Some(camera) = read.cameras.into_iter().next() {
            let used =
                edited.used_camera.map_or(scene.cameras.len().saturating_sub(1), |i| i as usize);
            match edited.cameras.get_mut(used) {
                Some(place) => *place = camera,
                None => edited.cameras.push(camera),
            }
        }
        let new_media = read.media.iter().skip(scene.media.len());
        if new_media.len() > 0 {
            edited.media.extend(new_media.cloned());
        }
        for (number, material) in self.materials.into_iter().zip(read.materials) {
            edited.materials[number] = material;
        }
        for (number, object) in self.transforms.into_iter().zip(&read.objects) {
            edited.objects[number].to_world = object.to_world;
        }
        match self.lights {
            None if is_given(changes, "lights")? => edited.lights = read.lights,
            None => {}
            Some(numbers) => {
                for (number, light) in numbers.into_iter().zip(read.lights) {
                    edited.lights[number] = light;
                }
            }
        }
        if is_given(changes, "settings")? {
            edited.settings = read.settings;
        }
        edited.warnings.extend(read.warnings);
        edited.missing.extend(read.missing);
        Ok(edited)
    }
}

fn is_given(changes: &Bound<'_, PyDict>, name: &str) -> PyResult<bool> {
    Ok(changes.get_item(name)?.is_some_and(|value| !value.is_none()))
}

/// Origin of an edited scene: its sources are those of the scene, and the edits so far as one.
fn origin(
    earlier: &SceneOrigin,
    SceneOrigin { sources, folder, .. }: SceneOrigin,
    hash: &str,
    has_camera: bool,
) -> SceneOrigin {
    let name = PathBuf::from("edits in memory");
    let mut all: Vec<SourceFile> = earlier.sources.clone();
    let before = all.iter().position(|source| source.path == name).map(|i| all.remove(i).hash);
    let edits = format!("{}{hash}", before.unwrap_or_default());
    // The first source is the edit itself.
    all.extend(sources.into_iter().skip(1).filter(|source| !earlier.sources.contains(source)));
    all.push(pathtracer::source_file(&name, edits.as_bytes()));
    let limits = earlier.options.limits.clone();
    let placement = earlier.placement.filter(|_| !has_camera);
    let options = LoadOptions { limits, ..LoadOptions::default() };
    SceneOrigin { file: None, folder, options, placement, sources: all }
}

/// Names of items, as they are.
pub(crate) fn names<T>(items: &[T], name: impl Fn(&T) -> &str) -> Vec<String> {
    items.iter().map(|item| name(item).to_owned()).collect()
}

/// Index of an item by its name, or by its number from 0.
///
/// # Errors
/// If there is none, or several have the name.
pub(crate) fn number(table: &str, key: &Bound<'_, PyAny>, names: &[String]) -> PyResult<usize> {
    let what = table.trim_start_matches("used_").trim_end_matches('s');
    let count = names.len();
    let Ok(name) = key.cast::<PyString>() else {
        let wrong = || {
            let found = key.get_type().name().map_or_else(|_| "?".into(), |name| name.to_string());
            PyTypeError::new_err(format!(
                "{table}: found a key of type {found}, expected str or int"
            ))
        };
        let number = key.call_method0("__index__").map_err(|_| wrong())?;
        let index = number.extract::<usize>().ok().filter(|index| *index < count);
        return index.ok_or_else(|| {
            let message = format!("{table}: found {number}, expected a number below {count}");
            PyValueError::new_err(message)
        });
    };
    let name = name.to_str()?;
    let mut places = (0..count).filter(|i| names[*i] == name);
    match (places.next(), places.next()) {
        (Some(index), None) => Ok(index),
        (Some(first), Some(second)) => Err(PyValueError::new_err(format!(
            "{table}: several have the name {name:?}, expected a number, such as {first} or {second}"
        ))),
        (None, _) => {
            let known = names.iter().map(String::as_str);
            let hint = if let Some(near) = suggestions(name, known.clone()).first() {
                format!("did you mean {near:?}?")
            } else {
                let some: Vec<_> = known.filter(|name| !name.is_empty()).take(10).collect();
                format!("known: {}", some.join(", "))
            };
            Err(PyValueError::new_err(format!("{table}: unknown {what} {name:?}; {hint}")))
        }
    }
}

/// The items of a table, cameras, lights or materials, as parts of Python with these transforms.
/// `names` are those of the materials among the items, and of the media of the scene.
pub(crate) fn parts<'py>(
    py: Python<'py>,
    table: &str,
    items: &Written,
    names: [&[String]; 2],
    transforms: &[DAffine3],
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let values = values::parts_to_python(py, items, names)?;
    let transforms = transforms.iter().map(|to_world| matrix(py, to_world));
    let transforms = transforms.collect::<PyResult<Vec<_>>>()?;
    py.import("pathtracer._edits")?.call_method1("parts", (table, values, transforms))?.extract()
}

/// Matrix of a transform: an array of shape (4, 4) and type float64.
pub(crate) fn matrix(py: Python<'_>, transform: &DAffine3) -> PyResult<Py<PyAny>> {
    let DAffine3 { matrix3: m, translation } = transform;
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], translation[i]];
    let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
    array(py, rows.as_flattened().to_vec(), &[4], Some(4))
}

/// Cameras of a scene as parts of Python.
pub(crate) fn cameras<'py>(
    py: Python<'py>,
    scene: &Written,
    cameras: Vec<pathtracer::Camera>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let transforms: Vec<_> = cameras.iter().map(|camera| camera.to_world).collect();
    let media = pathtracer::names_of(scene).1;
    let items = Written { cameras, ..Written::default() };
    parts(py, "cameras", &items, [&[], &media], &transforms)
}

/// A material of a scene as a part of Python.
pub(crate) fn material<'py>(
    py: Python<'py>,
    scene: &Written,
    name: &Bound<'py, PyString>,
) -> PyResult<Bound<'py, PyAny>> {
    let names = pathtracer::names_of(scene).0;
    let index = number("materials", name.as_any(), &names)?;
    let materials = vec![scene.materials[index].clone()].into();
    let items = Written { materials, ..Written::default() };
    only(parts(py, "materials", &items, [&names[index..=index], &[]], &[])?)
}

/// A light of a scene as a part of Python.
pub(crate) fn light<'py>(
    py: Python<'py>,
    scene: &Written,
    key: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let index = number("lights", key, &names(&scene.lights, |light| &light.name))?;
    let light = scene.lights[index].clone();
    let transforms = [light.to_world];
    let items = Written { lights: vec![light].into(), ..Written::default() };
    only(parts(py, "lights", &items, [&[], &[]], &transforms)?)
}

pub(crate) fn only(parts: Vec<Bound<'_, PyAny>>) -> PyResult<Bound<'_, PyAny>> {
    parts.into_iter().next().ok_or_else(internal)
}

/// Transforms of the objects of a scene, by names and numbers.
pub(crate) fn transforms<'py>(py: Python<'py>, scene: &Written) -> PyResult<Bound<'py, PyDict>> {
    let mut counts = HashMap::<&str, usize>::new();
    for object in &scene.objects {
        *counts.entry(&object.name).or_default() += 1;
    }
    let all = PyDict::new(py);
    for (number, object) in scene.objects.iter().enumerate() {
        let to_world = matrix(py, &object.to_world)?;
        if object.name.is_empty() || counts[object.name.as_str()] > 1 {
            all.set_item(number, to_world)?;
        } else {
            all.set_item(&object.name, to_world)?;
        }
    }
    Ok(all)
}
