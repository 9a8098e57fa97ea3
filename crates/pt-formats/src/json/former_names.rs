//! Names of earlier versions of the format.

/// Former names of types and of enum values, each with its current name.
const FORMER_TYPES: [(&str, &str); 8] = [
    ("matte", "diffuse"),
    ("sided", "two_sided"),
    ("embossed", "surface_detail"),
    ("cubes", "checkerboard3d"),
    ("facing", "abs_normal_dot"),
    ("root", "sqrt"),
    ("between", "pixel_centers"),
    ("from_pole_to_pole", "endpoints_at_poles"),
];

/// Former keys, each with its current name.
const FORMER_KEYS: [(&str, &str); 3] =
    [("saturates", "nonlinear"), ("film_offset", "principal_point_offset"), ("share", "amount")];

/// Returns the former name of a key, if it had one.
pub(super) fn former_key(name: &str) -> Option<&'static str> {
    FORMER_KEYS.iter().find(|(_, current)| *current == name).map(|(former, _)| *former)
}

/// Returns the current name of a type or enum value; files may have its former one.
pub(super) fn current_type(name: &str) -> &str {
    let renamed = FORMER_TYPES.iter().find(|(former, _)| *former == name);
    renamed.map_or(name, |(_, current)| current)
}
