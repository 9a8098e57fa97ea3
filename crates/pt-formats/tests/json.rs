//! The scene format of this program.

mod common;
#[path = "json/meaning.rs"]
mod meaning;
#[path = "json/measured.rs"]
mod measured;
#[path = "json/pages.rs"]
mod pages;
#[path = "json/python.rs"]
mod python;
#[path = "json/python_words.rs"]
mod python_words;
#[path = "json/round_trip.rs"]
mod round_trip;
#[path = "json/schema.rs"]
mod schema;

use common::{check_bad_files, check_good_files, check_robustness, files};

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("json", "json");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("json", "json");
}

#[test]
fn damaged_files_do_no_harm() {
    check_robustness("json", "json", 200 * files("json", "good", "json").len());
}
