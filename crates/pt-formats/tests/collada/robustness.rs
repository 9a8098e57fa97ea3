//! Broken, hostile and unusual files.

use std::path::Path;

use pt_formats::collada::compat::cs184_log;
use pt_formats::{LoadError, parse};

use crate::common::{most_rounds, mutation_seed, without_panics};
use crate::{FILES, check_invariants, files, good_text, name_of, read};

#[test]
fn no_prefix_of_a_good_file_makes_it_panic_or_passes_for_the_whole() {
    without_panics(|| {
        for file in files("good") {
            let bytes = std::fs::read(&file).expect("a readable file");
            let end = bytes.trim_ascii_end().len();
            for length in 0..end {
                let result = parse(&bytes[..length], name_of(&file));
                assert!(result.is_err(), "{}: {length} bytes of {end}", file.display());
            }
        }
    });
}

/// Pseudo-random generator of the tests below (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n
    }
}

/// Applies damage as files suffer it: flipped bits, changed bytes, missing and repeated pieces,
/// pieces of other files, and extreme numbers.
fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    const NASTY: [&str; 12] = [
        "-1",
        "4294967295",
        "18446744073709551615",
        "1e308",
        "NaN",
        "INF",
        "",
        "<",
        "</",
        "#",
        "&amp;",
        "é",
    ];
    let at = random.below(bytes.len());
    let end = at + random.below(bytes.len() - at).min(80);
    match random.below(12) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        2 => drop(bytes.drain(at..end)),
        3 => {
            let piece = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        4 => {
            let from = random.below(other.len());
            let piece = &other[from..other.len().min(from + end - at)];
            bytes.splice(at..at, piece.iter().copied());
        }
        _ => {
            let digits = |i: &usize| bytes[*i].is_ascii_digit();
            let start = (at..bytes.len()).find(digits).unwrap_or(at);
            let stop = (start..bytes.len()).find(|i| !digits(i)).unwrap_or(start);
            bytes.splice(start..stop, NASTY[random.below(NASTY.len())].bytes());
        }
    }
}

#[test]
fn no_damage_makes_it_panic() {
    without_panics(|| {
        let originals: Vec<_> =
            files("good").iter().map(|f| std::fs::read(f).expect("a readable file")).collect();
        let mut random = Random(0x00C0_11AD_A000_0001 ^ mutation_seed());
        let (mut read, mut refused) = (0, 0);
        for round in 0..most_rounds(20_000, originals.len()) {
            let mut bytes = originals[round % originals.len()].clone();
            let other = &originals[random.below(originals.len())];
            for _ in 0..=random.below(3) {
                damage(&mut bytes, other, &mut random);
                if bytes.is_empty() {
                    break;
                }
            }
            let log = cs184_log(&bytes, Path::new("damaged.dae"));
            match parse(&bytes, Path::new("damaged.dae")) {
                Ok(scene) => {
                    check_invariants(&scene);
                    log.expect("what can be read can be listed");
                    read += 1;
                }
                Err(error) => {
                    assert!(error.to_string().starts_with("damaged.dae"), "{error}");
                    refused += 1;
                }
            }
        }
        // Otherwise the damage would be too strong, or too weak, to reach most of the reader.
        assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
    });
}

/// Small files with large requests; each must be rejected immediately.
#[test]
fn files_cannot_ask_for_more_than_they_are_worth() {
    let text = good_text("transforms.dae");
    let refusal = |text: &str| read(text).expect_err("too much").to_string();

    let deep = format!("{}{}", "<node>".repeat(100_000), "</node>".repeat(100_000));
    let message = refusal(&text.replace("<node name=\"none\">", &format!("{deep}<node>")));
    assert!(message.contains("nested deeper than 1000"), "{message}");

    let attributes: String = (0..100_000).fold(String::new(), |s, i| s + &format!(" a{i}=''"));
    let message = refusal(&text.replace("<asset>", &format!("<asset{attributes}>")));
    assert!(message.contains("more than 1000 attributes"), "{message}");

    let namespaces = "<a xmlns:b='c'/>".repeat(20_000);
    let message = refusal(&text.replace("<asset>", &format!("{namespaces}<asset>")));
    assert!(message.contains("namespaces"), "{message}");

    // Thirty nodes, each of which contains the next one twice, are a billion nodes.
    let doubling = |i| format!("<instance_node url=\"#n{}\"/>", i + 1).repeat(2);
    let nodes = (0..30)
        .map(|i| format!("<node id=\"n{i}\">{}</node>", doubling(i)))
        .collect::<Vec<_>>()
        .concat();
    let nodes = format!("<library_nodes>{nodes}<node id=\"n30\"/>");
    let text = text.replace("<library_nodes>", &nodes).replace("#pair", "#n0");
    let message = refusal(&text);
    assert!(message.contains("exceeds 2000000 nodes"), "{message}");

    // A chain of nodes is as deep as nested nodes would be.
    let chain = (0..5000)
        .map(|i| format!("<node id=\"c{i}\"><instance_node url=\"#c{}\"/></node>", i + 1))
        .collect::<Vec<_>>()
        .concat();
    let message =
        refusal(&text.replace(&nodes, &format!("<library_nodes>{chain}")).replace("#n0", "#c0"));
    assert!(message.contains("nested deeper than 1000"), "{message}");

    let mesh = good_text("primitives.dae").replace("count=\"6\"", "count=\"18446744073709551615\"");
    read(&mesh).expect("counts are not believed");
}

#[test]
fn encodings_with_a_byte_order_mark() {
    let text = good_text("up_axis.dae").replace("id=\"n\"", "id=\"Kügelchen 😀\"");
    let expected = read(&text).expect("a good file");
    assert_eq!(expected.objects[0].name, "Kügelchen 😀");
    let units: Vec<u16> = "\u{FEFF}".encode_utf16().chain(text.encode_utf16()).collect();
    let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
    let marked = format!("\u{FEFF}{text}");
    for bytes in [&little[..], &big, marked.as_bytes()] {
        assert_eq!(parse(bytes, Path::new("scene.dae")).expect("a good file"), expected);
    }
}

/// The location of an error does not depend on line breaks.
#[test]
fn places_in_one_long_line() {
    let path = Path::new(FILES).join("bad/index_too_large.dae");
    let text = std::fs::read_to_string(path).expect("the file exists").replace('\n', " ");
    let text = text.replace("<asset>", &format!("<!--{}--><asset>", "é".repeat(10_000)));
    let Err(LoadError::Content { at, .. }) = read(&text) else { panic!("a bad file") };
    let (before, _) = text.split_once("3</p>").expect("the bad index");
    assert_eq!((at.line, at.column as usize), (1, before.chars().count() + 1));
}
