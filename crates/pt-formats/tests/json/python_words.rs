//! Names, types and meanings of the generated classes of Python that are not in the schema.

use serde_json::Value;

/// A generated module: its title, and definitions of the schema with the ends of the names of their
/// classes.
pub(super) struct Module {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) definitions: &'static [(&'static str, &'static str)],
}

/// All generated modules.
pub(super) const MODULES: [Module; 8] = [
    Module {
        name: "cameras",
        title: "Cameras.",
        definitions: &[("Camera", "Camera"), ("Aperture", "Aperture"), ("Meter", "Meter")],
    },
    Module {
        name: "lights",
        title: "Lights.",
        definitions: &[
            ("Light", "Light"),
            ("Profile", "IesProfile"),
            ("TimeRange", "TimeRange"),
            ("GeoLocation", "GeoLocation"),
        ],
    },
    Module {
        name: "materials",
        title: "Materials.",
        definitions: &[
            ("Material", "Material"),
            ("Roughness", "Roughness"),
            ("CoatNormals", "CoatNormals"),
            ("Measurements", "Measurements"),
        ],
    },
    Module {
        name: "media",
        title: "Participating media.",
        definitions: &[
            ("Medium", "Medium"),
            ("Phase", "Phase"),
            ("PlacedGrid", "PlacedGrid"),
            ("Grid", "Grid"),
            ("BlackBody", "BlackBody"),
        ],
    },
    Module {
        name: "objects",
        title: "Objects and their shapes.",
        definitions: &[
            ("Object", "Object"),
            ("Mesh", "Mesh"),
            ("Points", "Points"),
            ("Sides", "Sides"),
        ],
    },
    Module {
        name: "settings",
        title: "Settings of a scene.",
        definitions: &[("RenderHints", "Settings"), ("Filter", "Filter")],
    },
    Module {
        name: "textures",
        title: "Textures and images.",
        definitions: &[("Texture", "Texture"), ("TextureMapping", "Mapping"), ("Image", "Image")],
    },
    Module {
        name: "transforms",
        title: "Steps of transforms.",
        definitions: &[("Step", ""), ("Key", "MotionKey")],
    },
];

/// Meanings of keys of one class or definition.
pub(super) const STRUCTS: [(&str, &str, &str); 66] = [
    ("Aperture", "blades", "number of blades of the diaphragm, at least 3"),
    ("Aperture", "rotation", "rotation of the polygon, in degrees"),
    (
        "Meter",
        "quantity",
        "measured quantity: irradiance of the front of the surface, or radiance of parallel rays along the axis of the camera",
    ),
    ("IesProfile", "file", "path of an IES file, or its content as bytes"),
    ("TimeRange", "place", "place on the earth"),
    ("TimeRange", "timezone", "offset of local time, in hours"),
    ("TimeRange", "first", "year, month and day of the first day"),
    ("TimeRange", "days", "number of days"),
    ("TimeRange", "hours", "start and end of the hours of each day"),
    ("TimeRange", "part", "start and end of the part of the period that is averaged"),
    ("GeoLocation", "latitude", "latitude in degrees"),
    ("GeoLocation", "longitude", "longitude in degrees"),
    ("Material", "name", "name of the material"),
    ("Material", "emission", "radiance emitted from the front; emissive surfaces are lights"),
    (
        "Material",
        "hidden_emission",
        "True if the emission is invisible, both directly and in mirrors",
    ),
    ("Material", "opacity", "opacity; it does not change the emission"),
    ("Roughness", "alpha", "roughness α; alpha_u and alpha_v replace it"),
    ("Roughness", "alpha_u", "roughness α along increasing u"),
    ("Roughness", "alpha_v", "roughness α along increasing v"),
    ("Roughness", "distribution", "distribution of the facets"),
    ("Roughness", "masking", "masking and shadowing of facets"),
    ("Roughness", "multiple_scattering", "True if it includes multiple scattering between facets"),
    ("CoatNormals", "normal_map", "normal map with ∂p/∂u as +x"),
    ("CoatNormals", "along", "texture of directions a ∂p/∂u + b ∂p/∂v as +x"),
    ("CoatNormals", "turned_normal_map", "normal map that rotates with its to_pattern"),
    ("CoatNormals", "height_map", "bump map"),
    ("CoatNormals", "height", "factor of the bump map"),
    ("Measurements", "file", "path of a file of the RGL, or its content as bytes"),
    ("HenyeyGreensteinPhase", "g", "mean cosine of the scattering angle, between -1 and 1"),
    ("TablePhase", "values", "values at equidistant cosines of the scattering angle, from -1 to 1"),
    (
        "MicroflakesPhase",
        "matrices",
        "six numbers of each cell: xx, yy, zz, xy, xz, yz of the matrix S",
    ),
    ("BlendPhase", "first", "phase function for an amount of 0"),
    ("BlendPhase", "second", "phase function for an amount of 1"),
    ("BlendPhase", "amount", "weight of the second phase function"),
    ("PlacedGrid", "grid", "the grid, or the name of one"),
    ("PlacedGrid", "filter", "interpolation between cells"),
    ("Grid", "file", "path of a .vol file; resolution and values replace it"),
    ("Grid", "resolution", "number of cells along x, y and z"),
    ("Grid", "channels", "number of values of each cell: 1, 3 or 6"),
    ("Grid", "values", "values, of shape (n,) or (z, y, x, channels)"),
    ("BlackBody", "temperature", "temperatures in kelvins"),
    ("BlackBody", "scale", "radiance of the wavelength of the peak"),
    ("Sphere", "radius", "radius; the front of a sphere with a negative radius is its inside"),
    ("SphereMeter", "radius", "radius of the sphere"),
    (
        "PointsObject",
        "radius",
        "radius of spheres and cylinders, in the coordinates of the object; by default derived from their distances",
    ),
    ("PointsMeter", "radius", "radius of spheres and cylinders"),
    (
        "Mesh",
        "file",
        "path of a mesh file (.ply, .obj, .stl, .serialized, .safetensors); shape, or positions and triangles replace it",
    ),
    ("Mesh", "shape_index", "number of the mesh in a .serialized file, from 0"),
    ("Mesh", "shape", "generated mesh"),
    ("Mesh", "positions", "positions of the vertices, of shape (n, 3)"),
    (
        "Mesh",
        "triangles",
        "indices of the vertices of each triangle, counter-clockwise as seen from the front, of shape (m, 3)",
    ),
    (
        "Mesh",
        "normals",
        "normals, of shape (n, 3), one for each vertex unless there are normal_indices",
    ),
    (
        "Mesh",
        "uvs",
        "texture coordinates, of shape (n, 2), v upwards, one for each vertex unless there are uv_indices",
    ),
    (
        "Mesh",
        "colors",
        "colours, of shape (n, 3), one for each vertex unless there are color_indices",
    ),
    (
        "Mesh",
        "normal_indices",
        "indices of the normals of the corners of each triangle, of shape (m, 3)",
    ),
    (
        "Mesh",
        "uv_indices",
        "indices of the texture coordinates of the corners of each triangle, of shape (m, 3)",
    ),
    (
        "Mesh",
        "color_indices",
        "indices of the colours of the corners of each triangle, of shape (m, 3)",
    ),
    ("Mesh", "face_colors", "colours of the triangles, of shape (m, 3)"),
    ("Mesh", "vertex_attributes", "further values of the vertices by name, each of shape (n, 3)"),
    ("Mesh", "face_attributes", "further values of the triangles by name, each of shape (m, 3)"),
    (
        "Mesh",
        "parts",
        "first triangle, triangle after the last, and material slot of each part, of shape (parts, 3)",
    ),
    ("Points", "file", "path of a file (.ply, .obj, .safetensors); positions replace it"),
    ("Points", "positions", "positions, of shape (n, 3)"),
    ("Points", "colors", "colours, of shape (n, 3)"),
    ("Points", "segments", "indices of the ends of each segment, of shape (m, 2)"),
    ("Image", "file", "path of an image file; pixels replace it"),
];

/// Meanings of keys of several classes.
pub(super) const COMMON: [(&str, &str); 58] = [
    ("name", "name"),
    ("to_world", "transform to the world: steps, or a matrix of shape (3, 4) or (4, 4)"),
    (
        "motion",
        "keys of an animation, or the name of one, applied after the transform of the object",
    ),
    ("near", "distance of the near clipping plane"),
    ("far", "distance of the far clipping plane; infinite by default"),
    ("lens_radius", "radius of the lens; 0 for a pinhole"),
    ("focal_distance", "distance of the plane of focus"),
    ("aperture", "shape of the lens; a disk by default"),
    ("principal_point_offset", "offset of the film, in fractions of its width and height"),
    ("fit", "side of the view that is kept if the image has another aspect ratio"),
    ("medium", "medium around the camera"),
    ("shutter", "times at which the shutter opens and closes, in seconds"),
    ("placement", "node: as given; fit and course: so that all surfaces are visible"),
    ("meter", "meter that replaces the image"),
    ("x_fov", "horizontal angle of the whole view in degrees; one of both angles suffices"),
    ("y_fov", "vertical angle of the whole view in degrees; one of both angles suffices"),
    ("half_width", "half of the width of the view; one of both sizes suffices"),
    ("half_height", "half of the height of the view; one of both sizes suffices"),
    ("mesh", "the mesh, or the name of one"),
    ("points", "the points, or the name of an entry"),
    ("material", "material of the whole object; diffuse with reflectance 0.5 by default"),
    ("materials", "material of each slot of the mesh; None is the default material"),
    ("media", "media behind and in front of the surface"),
    ("interior", "medium behind the surface"),
    ("exterior", "medium in front of the surface"),
    ("translate", "translation, of shape (3,), or (2,) for textures"),
    ("rotate", "angle in degrees, counter-clockwise as seen from the tip of the axis"),
    ("axis", "axis of the rotation; +y by default, and none for textures"),
    ("scale", "factor of all axes, or of each"),
    ("look_at", "point at which a camera or light looks, along -z"),
    ("from", "position of the camera or light; the origin by default"),
    ("up", "direction on the side of +y; +y by default"),
    ("matrix", "rows of the matrix, of shape (3, 4) or (4, 4), or (3, 3) for textures"),
    ("time", "time in seconds"),
    ("resolution", "width and height of the image in pixels"),
    ("crop", "column and row of the upper left pixel of the crop window, its width and its height"),
    ("spp", "samples per pixel"),
    ("max_depth", "maximum number of bounces"),
    ("integrator", "name of the integrator"),
    ("aovs", "names of further channels"),
    ("filter", "reconstruction filter"),
    ("hidden", "what is hidden from the camera"),
    (
        "sides_by_shading_normal",
        "True if interpolated normals alone separate the front of a mesh from its back",
    ),
    (
        "straight_is_free",
        "True if the maximum depth does not count straight transmission through thin glass",
    ),
    ("radius", "radius in pixels"),
    ("stddev", "standard deviation in pixels"),
    ("b", "parameter B"),
    ("c", "parameter C"),
    ("lobes", "number of lobes"),
    ("layout", "mapping from points of a surface to coordinates"),
    ("to_pattern", "transform of the coordinates (u, v)"),
    ("to_texture", "transform from the world to the coordinates of the texture"),
    ("set", "number of the set of texture coordinates"),
    (
        "pixels",
        "colours of shape (height, width, 3), or greys of shape (height, width), top row first: real numbers in linear light, or sRGB levels of uint8",
    ),
    ("raw", "True if levels are no sRGB but values divided by the highest level"),
    ("extinction", "extinction per unit of length"),
    ("albedo", "fraction of the extinction that is scattered"),
    ("phase", "distribution of the directions of scattered light"),
];

/// Alias of the classes of a definition that has types.
pub(super) fn alias(definition: &str) -> Option<&'static str> {
    let aliases = [
        ("Camera", "Camera"),
        ("CoatNormals", "CoatNormals"),
        ("Filter", "Filter"),
        ("Light", "Light"),
        ("Material", "Material"),
        ("Medium", "Medium"),
        ("Meter", "Meter"),
        ("Object", "Object"),
        ("Phase", "Phase"),
        ("Texture", "Texture"),
        ("TextureMapping", "TextureLayout"),
        ("Step", "Step"),
    ];
    aliases.iter().find(|(of, _)| *of == definition).map(|(_, alias)| *alias)
}

/// Table of the scene with the entries of a definition.
pub(super) fn table(definition: &str) -> Option<&'static str> {
    let tables = [
        ("Material", "materials"),
        ("Medium", "media"),
        ("Mesh", "meshes"),
        ("Points", "points"),
        ("Image", "images"),
        ("Texture", "textures"),
        ("Grid", "grids"),
        ("Profile", "profiles"),
        ("Measurements", "measurements"),
    ];
    tables.iter().find(|(of, _)| *of == definition).map(|(_, table)| *table)
}

/// Title of a class.
pub(super) fn title(name: &str) -> &'static str {
    match name {
        "Camera" => "Camera",
        "Meter" => "Surface over which a camera measures one number in place of an image,",
        "Light" => "Light",
        "Material" => "Material",
        "Medium" => "Medium",
        "Phase" => "Phase function",
        "Texture" => "Texture",
        "TextureMapping" => "Layout of a texture",
        "Object" => "Object",
        "Filter" => "Reconstruction filter",
        "CoatNormals" => "Normals of a clear coat",
        "Aperture" => "Polygonal aperture of a lens",
        "IesProfile" => "Intensity distribution of a luminaire",
        "TimeRange" => "Period over which daylight is averaged",
        "GeoLocation" => "Place on the earth",
        "Roughness" => "Roughness of a surface of microfacets",
        "Measurements" => "Measured reflection of a material",
        "PlacedGrid" => "Grid with a transform from the unit cube",
        "Grid" => "Values in the cells of a box",
        "BlackBody" => "Thermal emission of a medium",
        "Mesh" => "Triangle mesh",
        "Points" => "Points and segments",
        "Sides" => "Media on both sides of a surface",
        "Settings" => "Settings of a render that belong to the scene",
        "Image" => "Image of a texture or an environment",
        "Translate" => "Translation",
        "Rotate" => "Rotation",
        "Scale" => "Scaling",
        "LookAt" => "Placement of a camera or light by the point at which it looks",
        "Matrix" => "Matrix of a transform",
        "MotionKey" => "Transform at a time",
        other => panic!("{other}: add its title to python_words.rs"),
    }
}

/// Type of the value of a key.
pub(super) fn python_type(definition: &str, key: &str, schema: &Value) -> String {
    match key {
        "file" if matches!(definition, "Profile" | "Measurements") => {
            return "str | PathLike[str] | bytes".to_owned();
        }
        "file" => return "str | PathLike[str]".to_owned(),
        "material" => return "Material | str".to_owned(),
        "materials" => return "Sequence[Material | str | None]".to_owned(),
        "medium" | "interior" | "exterior" => return "Medium | str".to_owned(),
        "motion" => return "Sequence[MotionKey | Mapping[str, Any]] | str".to_owned(),
        "to_world" | "to_texture" | "to_pattern" => {
            return "Step | Sequence[Step] | Array".to_owned();
        }
        "positions" | "triangles" | "pixels" | "values" | "matrix" => {
            return "Array".to_owned();
        }
        _ => {}
    }
    let mut all = Vec::new();
    collect(schema, &mut all);
    if all.contains(&"float".to_owned()) && all.contains(&"Vector".to_owned()) {
        all.retain(|kind| kind != "float" && kind != "Vector");
        all.insert(0, "Color".to_owned());
    }
    all.dedup();
    all.join(" | ")
}

fn collect(schema: &Value, all: &mut Vec<String>) {
    if let Some(variants) = schema["anyOf"].as_array() {
        for variant in variants {
            collect(variant, all);
        }
        return;
    }
    let kind = single(schema);
    if !kind.is_empty() && !all.contains(&kind) {
        all.push(kind);
    }
}

/// Type of a value without alternatives; empty for null.
fn single(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let definition = reference.rsplit('/').next().expect("a name");
        let definition = if definition == "Surface" { "Material" } else { definition };
        let single = match definition {
            "Profile" => "IesProfile",
            "RenderHints" => "Settings",
            other => alias(other).unwrap_or(other),
        };
        let has_alias = alias(definition).is_some();
        let other = if has_alias { "" } else { " | Mapping[str, Any]" };
        return format!("{single}{other}");
    }
    if let Some(names) = schema["enum"].as_array() {
        let names: Vec<_> = names.iter().map(ToString::to_string).collect();
        return format!("Literal[{}]", names.join(", "));
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds[0].as_str(),
        kind => kind.as_str(),
    };
    match kind.unwrap_or_default() {
        "null" => String::new(),
        "string" => "str".to_owned(),
        "integer" => "int".to_owned(),
        "number" => "float".to_owned(),
        "boolean" => "bool".to_owned(),
        "object" => {
            format!("Mapping[str, {}]", python_type("", "", &schema["additionalProperties"]))
        }
        "array" => match python_type("", "", &schema["items"]).as_str() {
            "float" | "int" => "Vector".to_owned(),
            "Vector" => "Array".to_owned(),
            item => format!("Sequence[{item}]"),
        },
        other => panic!("unknown type {other}"),
    }
}

/// Type in words, for a docstring.
pub(super) fn words(kind: &str) -> String {
    let kind = kind
        .replace(" | Mapping[str, Any]", "")
        .replace("Mapping[str, Array]", "dict of str to array");
    let mut parts = kind.split("Literal[");
    let mut kind = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (names, rest) = part.split_once(']').expect("the end of the names");
        kind.extend(["{", names, "}", rest]);
    }
    let kind = kind.replace("PathLike[str]", "os.PathLike").replace("Sequence[", "sequence of [");
    let kind = kind.replace(['[', ']'], "");
    let kind = kind.replace("Color", "float or color").replace("Vector", "sequence of numbers");
    let kind = kind.replace("Array", "array_like");
    kind.replace(" | ", " or ")
}
