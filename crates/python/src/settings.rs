//! Settings by keyword: from Python values to words of the command line.

use pt_cli::{Keyword, Purpose, keywords};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyMapping, PyString};

/// Settings of :func:`render`, described as the options of the program.
///
/// Some of these write files, which images in memory do not, and `time_limit` counts from the start
/// of the program there, here from the call.
///
/// Returns
/// -------
/// dict of str to str
///     Name and description of each, in the order of the program's help.
#[pyfunction]
pub(crate) fn settings(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    for Keyword { name, help, .. } in keywords(Purpose::Render) {
        all.set_item(name, help)?;
    }
    Ok(all)
}

/// Keywords with their words.
pub(crate) type Settings = Vec<(String, Vec<String>)>;

/// Converts keywords of a purpose to words; those with the value None are omitted.
pub(crate) fn words(purpose: Purpose, given: Option<&Bound<'_, PyDict>>) -> PyResult<Settings> {
    let known = keywords(purpose);
    let mut all = Settings::new();
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        let keyword = known.iter().find(|keyword| keyword.name == name);
        all.extend(words_of(&name, keyword, &value)?.map(|words| (name, words)));
    }
    Ok(all)
}

/// Words of a value; `None` if the keyword is omitted. Keywords that are not in the table, such as
/// aliases, are resolved later.
fn words_of(
    name: &str,
    keyword: Option<&Keyword>,
    value: &Bound<'_, PyAny>,
) -> PyResult<Option<Vec<String>>> {
    let is_flag = keyword.is_some_and(|keyword| keyword.is_flag);
    let values = keyword.map_or(1, |keyword| keyword.values);
    if value.is_none() {
        return Ok(None);
    }
    if value.is_instance_of::<PyBool>() {
        return match (value.is_truthy()?, is_flag, values) {
            (_, false, _) => Err(wrong(name, value, "a number or text")),
            (true, ..) => Ok(Some(Vec::new())),
            (false, _, 0) => Ok(None),
            (false, ..) => Ok(Some(vec!["off".to_owned()])),
        };
    }
    if is_flag && values == 0 {
        return Err(wrong(name, value, "True or False"));
    }
    if values > 1 {
        let items = items(value).ok_or_else(|| wrong(name, value, "a sequence of numbers"))?;
        if items.len() != values {
            let found = items.len();
            return Err(PyValueError::new_err(format!(
                "{name}: found {found} values, expected {values}"
            )));
        }
        return items.iter().map(|item| word(name, item)).collect::<PyResult<_>>().map(Some);
    }
    if let Ok(groups) = value.cast::<PyMapping>() {
        return groups_of(name, groups).map(|groups| Some(vec![groups]));
    }
    let list = match items(value) {
        Some(items) if items.is_empty() => return Ok(None),
        Some(items) => items.iter().map(|item| word(name, item)).collect::<PyResult<Vec<_>>>()?,
        None => vec![word(name, value)?],
    };
    Ok(Some(vec![list.join(",")]))
}

/// Items of a sequence that is not text, or of an array.
fn items<'py>(value: &Bound<'py, PyAny>) -> Option<Vec<Bound<'py, PyAny>>> {
    if value.is_instance_of::<PyString>() || value.is_instance_of::<PyBytes>() {
        return None;
    }
    value.try_iter().ok()?.collect::<PyResult<_>>().ok()
}

/// Groups of names: a name of a group for None, or else `GROUP=NAME+NAME`.
fn groups_of(name: &str, groups: &Bound<'_, PyMapping>) -> PyResult<String> {
    let mut all = Vec::new();
    for pair in groups.items()? {
        let (group, members): (String, Bound<'_, PyAny>) = pair.extract()?;
        if members.is_none() {
            all.push(group);
            continue;
        }
        let members = match items(&members) {
            Some(items) => items.iter().map(|item| word(name, item)).collect::<PyResult<_>>()?,
            None => vec![word(name, &members)?],
        };
        all.push(format!("{group}={}", members.join("+")));
    }
    Ok(all.join(","))
}

/// Word of a number, a text or a path.
pub(crate) fn word(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(text.to_str()?.to_owned());
    }
    if let Ok(path) = value.call_method0("__fspath__") {
        return path.extract().map_err(|_| wrong(name, value, "a path of text"));
    }
    if value.is_instance_of::<PyBool>() {
        return Err(wrong(name, value, "a number or text"));
    }
    // Also numbers of NumPy, by their conversions.
    for method in ["__index__", "__float__"] {
        if let Ok(number) = value.call_method0(method)
            && (number.is_instance_of::<PyInt>() || number.is_instance_of::<PyFloat>())
        {
            return Ok(number.str()?.to_str()?.to_owned());
        }
    }
    Err(wrong(name, value, "a number or text"))
}

fn wrong(name: &str, value: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    let found = value.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
    PyTypeError::new_err(format!("{name}: found {found}, expected {expected}"))
}
