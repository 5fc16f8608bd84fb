//! Bad input: one error that names file, place, what was wrong and what would be right; code 2; nothing written.

use std::path::{Path, PathBuf};

use crate::support::{assert_refused, clip, instep, leg_swing, listing, prestoe};

/// A folder with everything that a good run needs: `swing.json`, `kick.asf`, `kick_01.amc`, `kick.bvh`, `prestoe/`.
fn workspace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    leg_swing().save(&at("swing.json")).unwrap();
    for name in ["kick.asf", "kick_01.amc", "kick.bvh"] {
        std::fs::copy(clip(name), at(name)).unwrap();
    }
    std::fs::create_dir(at("prestoe")).unwrap();
    for name in ["robot.toml", "prestoe.xml"] {
        std::fs::copy(prestoe().join(name), at("prestoe").join(name)).unwrap();
    }
    folder
}

fn edit(file: PathBuf, change: impl FnOnce(String) -> String) {
    let text = std::fs::read_to_string(&file).unwrap();
    let changed = change(text.clone());
    assert_ne!(text, changed, "{} was not changed", file.display());
    std::fs::write(file, changed).unwrap();
}

/// The command is refused with an error that holds `words`.
fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before = listing(folder);
    for json in [&[][..], &["--json"]] {
        let output = instep(folder, &[arguments, json].concat());
        assert_refused(&output, words, folder, &before);
    }
}

const AMC: [&str; 7] = ["retarget", "--stage", "kinematic", "--skeleton", "kick.asf", "--clip", "kick_01.amc"];
const BVH: [&str; 7] = ["retarget", "--stage", "kinematic", "--clip", "kick.bvh", "--unit", "1"];
const WHOLE: [&str; 5] = ["retarget", "--skeleton", "kick.asf", "--clip", "kick_01.amc"];
const KICK: [&str; 3] = ["kick", "--reference", "swing.json"];

#[test]
fn a_missing_file() {
    let folder = workspace();
    let folder = folder.path();
    refused(folder, &["kick", "--reference", "none.json"], &["none.json", "no such file", "expected", "--reference"]);
    refused(folder, &[&KICK[..], &["--robot", "nobody"]].concat(), &["nobody", "no such robot", "prestoe"]);
    refused(folder, &[&KICK[..], &["--world", "none.toml"]].concat(), &["none.toml", "no such file", "--world"]);
    refused(folder, &["retarget", "--clip", "none.amc"], &["none.amc", "no such file", ".bvh", "--clip"]);
    let skeleton = ["retarget", "--clip", "kick_01.amc", "--skeleton", "none.asf"];
    refused(folder, &skeleton, &["none.asf", "no such file", "--skeleton"]);
    refused(folder, &["robot", "check", "none"], &["none", "no such file", "expected"]);
    std::fs::remove_file(folder.join("kick.asf")).unwrap();
    refused(folder, &["retarget", "--clip", "kick_01.amc"], &["kick.asf", "cannot be read"]);
    std::fs::remove_file(folder.join("prestoe/prestoe.xml")).unwrap();
    refused(folder, &[&KICK[..], &["--robot", "./prestoe"]].concat(), &["prestoe.xml", "cannot be read"]);
}

#[test]
fn a_truncated_file() {
    for (name, arguments) in [
        ("kick_01.amc", &AMC[..]),
        ("kick.asf", &AMC[..]),
        ("kick.bvh", &BVH[..]),
        ("swing.json", &KICK[..]),
        ("prestoe/robot.toml", &["kick", "--reference", "swing.json", "--robot", "./prestoe"]),
        ("prestoe/prestoe.xml", &["kick", "--reference", "swing.json", "--robot", "./prestoe"]),
    ] {
        let folder = workspace();
        // In the middle of a number or a name.
        edit(folder.path().join(name), |text| {
            let middle = text.len() * 3 / 5;
            let cut = middle + text[middle..].find(|c: char| c.is_alphanumeric()).unwrap() + 1;
            text[..cut].to_owned()
        });
        refused(folder.path(), arguments, &[Path::new(name).file_name().unwrap().to_str().unwrap()]);
    }
}

#[test]
fn a_garbled_file() {
    for (name, arguments) in
        [("kick_01.amc", &AMC[..]), ("kick.asf", &AMC[..]), ("kick.bvh", &BVH[..]), ("swing.json", &KICK[..])]
    {
        let folder = workspace();
        std::fs::write(folder.path().join(name), b"\x00\xff\xfeKick me! {[(\x80\n1 2 3\n").unwrap();
        refused(folder.path(), arguments, &[name, "expected"]);
    }
    let folder = workspace();
    edit(folder.path().join("kick_01.amc"), |text| text.replacen("rfemur ", "rfemur x", 1));
    refused(folder.path(), &AMC, &["kick_01.amc:", "expected"]);
}

#[test]
fn a_skeleton_that_does_not_fit_its_clip() {
    let folder = workspace();
    edit(folder.path().join("kick_01.amc"), |text| text.replace("rfemur", "tail"));
    refused(folder.path(), &AMC, &["kick_01.amc:", "tail", "expected"]);
    let folder = workspace();
    edit(folder.path().join("kick.bvh"), |text| text.replace("RightUpLeg", "Tentacle"));
    refused(folder.path(), &BVH, &["kick.bvh", "right thigh", "rightupleg"]);
}

#[test]
fn numbers_that_are_none() {
    let folder = workspace();
    edit(folder.path().join("kick_01.amc"), |text| {
        let line = text.lines().find(|line| line.starts_with("rtibia ")).unwrap().to_owned();
        text.replacen(&line, "rtibia nan", 1)
    });
    refused(folder.path(), &AMC, &["kick_01.amc:", "nan", "expected"]);

    let folder = workspace();
    edit(folder.path().join("prestoe/prestoe.xml"), |text| text.replacen("mass=\"4.2\"", "mass=\"nan\"", 1));
    refused(folder.path(), &[&KICK[..], &["--robot", "./prestoe"]].concat(), &["prestoe.xml", "nan"]);

    let folder = workspace();
    edit(folder.path().join("prestoe/robot.toml"), |text| text.replacen("kp = 400.0", "kp = nan", 1));
    refused(
        folder.path(),
        &[&KICK[..], &["--robot", "./prestoe"]].concat(),
        &["robot.toml", "group[0].kp", "NaN", "expected"],
    );

    let folder = workspace();
    std::fs::write(folder.path().join("world.toml"), "[ball]\nmass = nan\n").unwrap();
    refused(folder.path(), &[&KICK[..], &["--world", "world.toml"]].concat(), &["world.toml", "ball.mass", "NaN"]);

    let folder = workspace();
    for (option, value, right) in
        [("--start", "nan", "from 0 to 0.5"), ("--duration", "nan", "above 0"), ("--ball", "nan,0", "two numbers")]
    {
        refused(folder.path(), &[&KICK[..], &[option, value]].concat(), &[right]);
    }
    refused(folder.path(), &[&AMC[..], &["--rate", "nan"]].concat(), &["rate", "NaN", "1 to 1000"]);
}

#[test]
fn drives_senses_and_balls_that_cannot_be() {
    for (from, to, words) in [
        ("period = 0.001", "period = 0", ["drives.period", "0", "0.0001"]),
        ("delay = 0.001\nsag", "delay = -0.001\nsag", ["drives.delay", "-0.001", "0 to 0.2 s"]),
        ("sag = 0.05", "sag = 1.5", ["drives.sag", "1.5", "[0, 0.9]"]),
        ("kind = \"torque\"", "kind = \"magic\"", ["line", "magic", "position_servo"]),
        ("play = 0.001", "play = 7.0", ["group[0].play", "7", "joint's range"]),
        ("static_friction = 0.48", "static_friction = 480", ["group[0].static_friction", "480", "torque"]),
        ("[senses]\ndelay = 0.001", "[senses]\ndelay = -1", ["senses.delay", "-1", "0 to 0.2 s"]),
        ("[senses]\ndelay", "[senses]\nlag", ["line", "lag", "delay"]),
        ("field_of_view = [1.5, 1.2]", "field_of_view = [1.5, 4]", ["camera.field_of_view", "4", "3.1"]),
    ] {
        let folder = workspace();
        edit(folder.path().join("prestoe/robot.toml"), |text| text.replacen(from, to, 1));
        let words = [&["robot.toml"][..], &words].concat();
        refused(folder.path(), &[&KICK[..], &["--robot", "./prestoe"]].concat(), &words);
    }
    let folder = workspace();
    for (text, words) in [
        ("ball = \"size-9\"\n", ["size-9", "size-5, size-1, spl-foam"]),
        ("drives = \"perfect\"\n", ["perfect", "as_built"]),
        ("[step]\ntick = 0\n", ["step.tick", "above 0"]),
        ("[sensors]\ndelay = -0.1\n", ["sensors.delay", "at least 0"]),
    ] {
        std::fs::write(folder.path().join("world.toml"), text).unwrap();
        let words = [&["world.toml"][..], &words].concat();
        refused(folder.path(), &[&KICK[..], &["--world", "world.toml"]].concat(), &words);
        refused(folder.path(), &["bench", "--quick", "--robot", "nao", "--world", "world.toml"], &words);
        refused(folder.path(), &["walk", "--velocity", "0.1,0,0", "--world", "world.toml"], &words);
    }
    refused(folder.path(), &[&KICK[..], &["--world", "ideel"]].concat(), &["ideel", "no such file", "ideal"]);
}

#[test]
fn a_robot_file_whose_roles_name_joints_that_do_not_exist() {
    let folder = workspace();
    edit(folder.path().join("prestoe/robot.toml"), |text| {
        text.replace("knee = \"left_knee\"", "knee = \"left_kneee\"")
    });
    let words = ["robot.toml", "leg.left.knee", "left_kneee", "the nearest is \"left_knee\""];
    refused(folder.path(), &[&KICK[..], &["--robot", "./prestoe"]].concat(), &words);
    refused(folder.path(), &[&AMC[..], &["--robot", "./prestoe"]].concat(), &words);
    refused(folder.path(), &["robot", "check", "prestoe"], &words);
}

#[test]
fn a_model_without_a_free_joint() {
    let folder = workspace();
    edit(folder.path().join("prestoe/prestoe.xml"), |text| text.replace("<freejoint name=\"root\"/>", ""));
    let words = ["prestoe.xml", "no free joint", "<freejoint/>"];
    refused(folder.path(), &[&KICK[..], &["--robot", "./prestoe"]].concat(), &words);
    refused(folder.path(), &[&AMC[..], &["--robot", "./prestoe"]].concat(), &words);
}

#[test]
fn an_output_folder_that_cannot_be_written() {
    // Tests may run as root, for whom every folder can be written: a path under a regular file cannot be for anybody.
    let folder = workspace();
    std::fs::write(folder.path().join("file"), "").unwrap();
    let words = ["file", "cannot be written", "expected a folder"];
    refused(folder.path(), &[&KICK[..], &["--out", "file"]].concat(), &words);
    refused(folder.path(), &[&KICK[..], &["--out", "file/deeper/out"]].concat(), &words);
    refused(folder.path(), &[&AMC[..], &["--out", "file/x.json"]].concat(), &words);
    refused(folder.path(), &[&AMC[..], &["--out", "x.json", "--report", "file/x.html"]].concat(), &words);
    refused(folder.path(), &[&AMC[..], &["--out", "prestoe"]].concat(), &["prestoe", "is a folder", "expected"]);
}

#[test]
fn options_that_do_not_go_together() {
    let folder = workspace();
    let folder = folder.path();
    refused(folder, &["retarget", "--clip", "kick.bvh"], &["kick.bvh", "unit"]);
    refused(folder, &[&BVH[..], &["--skeleton", "kick.asf"]].concat(), &["kick.asf", "BVH", "expected"]);
    refused(folder, &[&KICK[..], &["--robot", "nao"]].concat(), &["swing.json", "prestoe", "nao", "retarget"]);
    refused(folder, &[&KICK[..], &["--start", "9"]].concat(), &["swing.json", "9", "0.5"]);
    refused(folder, &[&KICK[..], &["--duration", "-1"]].concat(), &["--duration", "-1", "above 0"]);
    refused(folder, &["kick", "--nonsense"], &["--nonsense"]);
    refused(folder, &[&WHOLE[..], &["--form", "slip"]].concat(), &["--form", "slip", "--stage kinematic"]);
    refused(folder, &[&AMC[..], &["--time-scale", "1.2"]].concat(), &["--time-scale", "--stage kinodynamic"]);
    refused(folder, &[&AMC[..], &["--ball", "0.1,0"]].concat(), &["--ball", "--stage kinodynamic"]);
}

#[test]
fn settings_of_retargeting_that_cannot_be() {
    let folder = workspace();
    let folder = folder.path();
    let write = |text: &str| std::fs::write(folder.join("settings.toml"), text).unwrap();
    let arguments = [&WHOLE[..], &["--settings", "settings.toml"]].concat();
    refused(folder, &[&WHOLE[..], &["--settings", "none.toml"]].concat(), &["none.toml", "no such file"]);
    write("[kinodynamic]\nfriktion = 0.5\n");
    refused(folder, &arguments, &["settings.toml", "friktion", "friction"]);
    write("[kinodynamic]\nfriction = -1.0\n");
    refused(folder, &arguments, &["settings.toml", "kinodynamic.friction", "-1", "0.1 to 2"]);
    write("[kinodynamic.weights]\nq_m = nan\n");
    refused(folder, &arguments, &["settings.toml", "kinodynamic.weights.q_m", "NaN"]);
    write("[kinodynamic.ground]\nspacing = 0.1\nheights = [[0.0, 0.05], [0.0]]\n");
    refused(folder, &arguments, &["settings.toml", "kinodynamic.ground.heights[1]", "1 heights", "expected 2"]);
    write("[kinodynamic.ground]\nheight = 0.05\n");
    refused(folder, &arguments, &["settings.toml", "height", "heights"]);
    for (option, value, right) in [
        ("--time-scale", "9", "0.5 to 4"),
        ("--time-scale", "nan", "NaN"),
        ("--ball", "3,0", "kinodynamic.ball[0]"),
        ("--aim", "170", "kinodynamic.aim"),
        ("--foot-speed", "-3", "kinodynamic.foot_speed"),
        ("--rate", "7", "60 to 480"),
    ] {
        refused(folder, &[&WHOLE[..], &[option, value]].concat(), &[right]);
    }
}

/// The stage that failed is named, and nothing is written that could be taken for a result.
#[test]
fn a_clip_without_a_kick() {
    let folder = workspace();
    // The first frame over and over: somebody who stands.
    edit(folder.path().join("kick_01.amc"), |text| {
        let is_number = |line: &&str| line.trim().parse::<usize>().is_ok();
        let header: Vec<&str> = text.lines().take_while(|line| !is_number(line)).collect();
        let pose: Vec<&str> =
            text.lines().skip_while(|line| !is_number(line)).skip(1).take_while(|line| !is_number(line)).collect();
        let frames = (1..=60).map(|frame| format!("{frame}\n{}\n", pose.join("\n")));
        format!("{}\n{}", header.join("\n"), frames.collect::<String>())
    });
    refused(folder.path(), &WHOLE, &["kick_01.amc", "no kick", "rescaling"]);
}

/// Somebody who rises by 2 m/s from the plant on: the foot beside the ball does not stand.
#[test]
fn a_clip_without_a_stance() {
    let folder = workspace();
    edit(folder.path().join("kick_01.amc"), |text| {
        let mut frame = 0.0_f64;
        let raised = text.lines().map(|line| {
            let Some(root) = line.strip_prefix("root ") else { return format!("{line}\n") };
            frame += 1.0;
            let mut values: Vec<f64> = root.split(' ').map(|value| value.parse().unwrap()).collect();
            // Up is the third; units of an inch over 0.45, 60 frames a second.
            values[2] += (frame - 9.0).max(0.0) * 2.0 / 60.0 * 0.45 / 0.0254;
            let values: Vec<String> = values.iter().map(f64::to_string).collect();
            format!("root {}\n", values.join(" "))
        });
        raised.collect()
    });
    let arguments = [&WHOLE[..], &["--clip-rate", "60"]].concat();
    refused(folder.path(), &arguments, &["kick_01.amc", "no stance", "left foot", "rescaling"]);
}
