//! Names of objects and materials in mattes.

use std::collections::{HashMap, HashSet};

use pt_core::film::Aov;
use pt_scene::Scene;
use serde::{Deserialize, Serialize};

use crate::explain::title;

/// Name of all geometry of lights that is not an object of the scene.
const LIGHTS: &str = "lights";

/// Name of the material of objects without any.
const DEFAULT: &str = "default";

/// Names of the objects and materials that a film counts, indexed by their numbers in the film. The
/// names of objects are unique, and so are those of materials; both lists are empty if the film
/// counts none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MatteNames {
    /// Names of [`Aov::CryptomatteObject`].
    objects: Vec<String>,
    /// Names of [`Aov::CryptomatteMaterial`].
    materials: Vec<String>,
}

impl MatteNames {
    /// Returns the names that a film with these AOVs needs. Names of objects are those of
    /// [`crate::explain`], materials have their own name; a name that is already taken gets a
    /// number as a suffix.
    pub fn of(scene: &Scene, aovs: &[Aov]) -> Self {
        let mut names = Self::default();
        if aovs.contains(&Aov::CryptomatteObject) {
            names.objects = distinct(objects(scene).chain([LIGHTS.to_owned()]), " ");
        }
        if aovs.contains(&Aov::CryptomatteMaterial) {
            let materials = scene.materials.iter().enumerate().map(|(number, material)| {
                let name = &material.name;
                if name.is_empty() { format!("material {number}") } else { name.clone() }
            });
            names.materials = distinct([DEFAULT.to_owned()].into_iter().chain(materials), " ");
        }
        names
    }

    /// Returns true if there are no names.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && self.materials.is_empty()
    }

    /// Names that an AOV counts; empty for AOVs without mattes.
    pub(super) fn counted_by(&self, aov: Aov) -> &[String] {
        match aov {
            Aov::CryptomatteObject => &self.objects,
            Aov::CryptomatteMaterial => &self.materials,
            _ => &[],
        }
    }
}

/// Returns the names of the objects of a scene, as in [`crate::explain`].
pub(crate) fn objects(scene: &Scene) -> impl Iterator<Item = String> {
    let mut namesakes: HashMap<&str, u32> = HashMap::new();
    for object in &scene.objects {
        *namesakes.entry(&object.name).or_default() += 1;
    }
    let objects = scene.objects.iter().enumerate();
    objects.map(move |(number, object)| title(object, number, namesakes[object.name.as_str()] == 1))
}

/// Makes names unique: a name that is already taken gets the separator and a number from 2 on as a
/// suffix.
pub(crate) fn distinct(names: impl Iterator<Item = String>, separator: &str) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut last: HashMap<String, u32> = HashMap::new();
    let mut own = |name: String| {
        let mut full = name.clone();
        while !taken.insert(full.clone()) {
            let number = last.entry(name.clone()).or_insert(1);
            *number += 1;
            full = format!("{name}{separator}{number}");
        }
        full
    };
    names.map(&mut own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_author_and_all_differ() {
        let mut scene = crate::default_scene();
        let of = |scene: &Scene, aov| MatteNames::of(scene, &[aov]).counted_by(aov).to_vec();
        let (objects, materials) = (Aov::CryptomatteObject, Aov::CryptomatteMaterial);
        let own: Vec<_> = scene.objects.iter().map(|object| object.name.clone()).collect();
        assert_eq!(of(&scene, objects), [own, vec!["lights".into()]].concat());
        let named: Vec<_> = scene.materials.iter().map(|material| material.name.clone()).collect();
        assert_eq!(of(&scene, materials), [vec!["default".into()], named].concat());
        scene.objects.to_mut().truncate(4);
        for (object, (name, line)) in
            scene.objects.iter_mut().zip([("a", 7), ("lights", 8), ("a", 7), ("", 0)])
        {
            (object.name, object.at.line) = (name.into(), line);
            object.at.file = "there/room.xml".into();
        }
        let wanted = ["a room.xml:7", "lights", "a room.xml:7 2", "3", "lights 2"];
        assert_eq!(of(&scene, objects), wanted);
        scene.materials.to_mut().truncate(4);
        for (material, name) in scene.materials.iter_mut().zip(["default", "", "x 2", "x"]) {
            material.name = name.into();
        }
        let again = scene.materials[3].clone();
        scene.materials.push(again);
        let wanted = ["default", "default 2", "material 1", "x 2", "x", "x 3"];
        assert_eq!(of(&scene, materials), wanted);
        assert!(MatteNames::of(&scene, &[Aov::Object, Aov::Material]).is_empty());
    }
}
