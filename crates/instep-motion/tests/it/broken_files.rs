//! Truncated and garbled clips are errors with file and line, or clips that pass validation; never a panic.

use std::path::Path;

use instep_motion::clip::Clip;
use instep_motion::{MotionError, asf, bvh};
use proptest::prelude::*;

use crate::synthetic::{RATE, data};

/// The first lines of a file.
fn head(name: &str, lines: usize) -> Vec<u8> {
    let text = std::fs::read_to_string(data(name)).unwrap();
    text.split_inclusive('\n').take(lines).collect::<String>().into_bytes()
}

fn bvh_of_two_frames() -> Vec<u8> {
    let text = std::fs::read_to_string(data("kick.bvh")).unwrap();
    let (hierarchy, motion) = text.split_once("Frames: 48\n").unwrap();
    let motion: String = motion.split_inclusive('\n').take(3).collect();
    format!("{hierarchy}Frames: 2\n{motion}").into_bytes()
}

/// An error names the file and a line of it; a clip is valid.
fn check(result: Result<Clip, MotionError>, file: &Path, lines: usize) {
    match result {
        Ok(clip) => clip.validate().unwrap(),
        Err(MotionError::Syntax { file: named, line, found, expected }) => {
            assert_eq!(named, file);
            assert!((1..=lines.max(1)).contains(&line), "line {line} of {lines}");
            assert!(!found.is_empty() || !expected.is_empty());
        }
        Err(other) => panic!("{other}"),
    }
}

/// Reads `bytes` as a file of the kind that `name` is.
fn read(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    let lines = String::from_utf8_lossy(bytes).lines().count();
    match path.extension().and_then(|e| e.to_str()) {
        Some("asf") => match asf::load_skeleton(&path) {
            Ok(skeleton) => skeleton.validate().unwrap(),
            Err(error) => check(Err(error), &path, lines),
        },
        Some("amc") => check(asf::load_clip(&data("kick.asf"), &path, RATE), &path, lines),
        _ => check(bvh::load_clip(&path, bvh::CENTIMETRE), &path, lines),
    }
}

fn originals() -> [(&'static str, Vec<u8>); 3] {
    [("a.asf", head("kick.asf", usize::MAX)), ("a.amc", head("kick_01.amc", 40)), ("a.bvh", bvh_of_two_frames())]
}

#[test]
fn a_file_cut_at_any_byte() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in originals() {
        for cut in 0..=bytes.len() {
            read(folder.path(), name, &bytes[..cut]);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_file_with_bytes_changed(changes in prop::collection::vec((0.0..1.0_f64, any::<u8>()), 1..6)) {
        let folder = tempfile::tempdir().unwrap();
        for (name, mut bytes) in originals() {
            for (place, byte) in &changes {
                let i = (place * bytes.len() as f64) as usize;
                bytes[i] = *byte;
            }
            read(folder.path(), name, &bytes);
        }
    }

    #[test]
    fn a_file_with_words_changed(
        changes in prop::collection::vec((0.0..1.0_f64, prop::sample::select(WORDS)), 1..4),
    ) {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in originals() {
            let mut text = String::from_utf8(bytes).unwrap();
            for (place, word) in &changes {
                let places: Vec<(usize, String)> =
                    text.split_whitespace().map(|w| (w.as_ptr() as usize - text.as_ptr() as usize, w.to_owned())).collect();
                let (at, old) = &places[(place * places.len() as f64) as usize];
                text.replace_range(*at..at + old.len(), word);
            }
            read(folder.path(), name, text.as_bytes());
        }
    }

    #[test]
    fn lines_dropped_doubled_or_swapped(a in 0.0..1.0_f64, b in 0.0..1.0_f64, how in 0_u8..3) {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in originals() {
            let text = String::from_utf8(bytes).unwrap();
            let mut lines: Vec<&str> = text.lines().collect();
            let [i, j] = [a, b].map(|place| (place * lines.len() as f64) as usize);
            match how {
                0 => drop(lines.remove(i)),
                1 => lines.insert(i, lines[j]),
                _ => lines.swap(i, j),
            }
            read(folder.path(), name, lines.join("\n").as_bytes());
        }
    }
}

const WORDS: &[&str] = &[
    "nan",
    "inf",
    "-1e308",
    "1e308",
    "1e-320",
    "99999999999999999999",
    "0",
    "-1",
    "root",
    "begin",
    "end",
    ":root",
    ":hierarchy",
    "{",
    "}",
    "JOINT",
    "ROOT",
    "End",
    "MOTION",
    "lfemur",
    "ltibia",
    "dof",
    "axis",
    "#",
    "",
    "XYZ",
    "rx",
];

#[test]
fn files_that_are_not_there_or_not_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.bvh");
    assert!(matches!(bvh::load_clip(&path, 0.01), Err(MotionError::Read { .. })));
    assert!(matches!(asf::load_skeleton(folder.path()), Err(MotionError::Read { .. })));
    read(folder.path(), "a.asf", &[0xff, 0xfe, 0, 1, 2, 10, 200]);
    read(folder.path(), "a.bvh", &[0xff; 1000]);
    for rate in [0.0, -1.0, f64::NAN] {
        assert!(asf::load_clip(&data("kick.asf"), &data("kick_01.amc"), rate).is_err());
        assert!(bvh::load_clip(&data("kick.bvh"), rate).is_err());
    }
}

#[test]
fn messages_say_place_found_and_expected() {
    let folder = tempfile::tempdir().unwrap();
    let say = |name: &str, from: &str, to: &str| {
        let text = std::fs::read_to_string(data(name)).unwrap();
        assert!(text.contains(from), "{name} has no {from:?}");
        let path = folder.path().join(name);
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = match name {
            "kick.asf" => asf::load_skeleton(&path).err(),
            "kick_01.amc" => asf::load_clip(&data("kick.asf"), &path, RATE).err(),
            _ => bvh::load_clip(&path, bvh::CENTIMETRE).err(),
        };
        let error = error.unwrap().to_string();
        error.strip_prefix(&folder.path().display().to_string()).unwrap().to_owned()
    };
    let cases = [
        ("kick.asf", "angle deg", "angle turns", "/kick.asf:7: turns; expected deg or rad"),
        ("kick.asf", "dof rx", "dof tx", "expected rx, ry or rz"),
        (
            "kick.asf",
            "    lfemur ltibia",
            "    lfemur root",
            "root; expected a bone of :bonedata that has no other parent",
        ),
        ("kick.asf", "    lfemur ltibia", "", "ltibia without a parent in :hierarchy"),
        ("kick_01.amc", "head ", "heads ", "/kick_01.amc:15: \"heads\"; expected a bone of the skeleton"),
        ("kick_01.amc", "\n2\n", "\n3\n", "frame 3 after 1; expected the next number"),
        ("kick_01.amc", "ltibia ", "ltibia 0 ", "2 values; expected 1, as the skeleton says"),
        ("kick.bvh", "Frames: 48", "Frames: 49", "48 frames; expected 49, as Frames: says"),
        ("kick.bvh", "Frames: 48", "Frames: 47", "one more line; expected the end of the file after 47 frames"),
        ("kick.bvh", "CHANNELS 3", "CHANNELS 4", "expected CHANNELS, their number and as many names"),
        ("kick.bvh", "Frame Time: 0.0166667", "Frame Time: 0", "expected Frame Time: and seconds"),
    ];
    for (name, from, to, want) in cases {
        let got = say(name, from, to);
        assert!(got.contains(want), "{got}\n{want}");
    }
}
