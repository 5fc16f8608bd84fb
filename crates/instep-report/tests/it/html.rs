//! The page: self-contained, escaped, the same each time, and written whole or not at all.

use instep_report::*;

fn report() -> Report {
    let times: Vec<f64> = (0..20).map(|frame| f64::from(frame) * 0.01).collect();
    let poses = times.iter().map(|&t| Pose::at([t as f32, 0.0, 0.11])).collect();
    let ball = Part { shape: Shape::Sphere { radius: 0.11 }, color: Color::SHELL, finish: Finish::Football, poses };
    let force = Arrow {
        name: "force".into(),
        color: Color::ORANGE,
        metres_per_unit: 0.001,
        frames: vec![ArrowFrame { origin: [0.0; 3], vector: [0.0, 0.0, 500.0] }],
    };
    Report {
        matrix: None,
        title: "Kick 7".into(),
        subtitle: "a subtitle".into(),
        summary: vec![SummaryItem::new("Ball speed", "4.2 m/s", Verdict::Good, "wanted 4.0")],
        tables: vec![Table {
            title: "Measures".into(),
            columns: vec![Column::text("what"), Column::number("value")],
            rows: vec![vec!["direction".into(), Cell::judged("3.1 deg", Verdict::Bad)]],
        }],
        replay: Some(Replay {
            times: times.clone(),
            actors: vec![Actor { name: "Ball".into(), parts: vec![ball], arrows: vec![force], ..Actor::default() }],
            events: vec![Event { time: 0.1, label: "impact".into() }],
            pitch: Some(Pitch::kid_size()),
            camera: None,
        }),
        plots: vec![Plot {
            title: "Height".into(),
            y_label: "m".into(),
            series: vec![Series::shared("ball", times.iter().map(|t| t * t).collect())],
            limits: vec![Limit { label: "limit".into(), value: 0.03 }],
            regions: vec![Region { label: "swing".into(), from: 0.0, to: 0.1 }],
            ..Plot::default()
        }],
        notes: vec!["A note.".into()],
    }
}

#[test]
fn page_needs_no_network() {
    let html = report().html();
    let without_namespace = html.replace("http://www.w3.org/2000/svg", "");
    for word in ["http:", "https:", "//cdn", "@import", "url(//", " src=", "<link", "fetch(", "XMLHttpRequest"] {
        assert!(!without_namespace.contains(word), "the page contains {word:?}");
    }
    assert!(html.contains("default-src 'none'"));
    assert!(!html.contains("{{"), "a slot was left unfilled");
}

#[test]
fn strings_are_escaped_everywhere() {
    let evil = "</script><script>alert('{{data}}')</script> & \"quoted\" \u{2028}";
    let mut report = report();
    report.title = evil.into();
    report.subtitle = evil.into();
    report.notes = vec![evil.into()];
    report.summary[0] = SummaryItem::new(evil, evil, Verdict::Bad, evil);
    report.tables[0].title = evil.into();
    report.tables[0].columns[0].title = evil.into();
    report.tables[0].rows[0][0] = evil.into();
    report.plots[0].title = evil.into();
    report.plots[0].y_label = evil.into();
    report.plots[0].series[0].name = evil.into();
    report.plots[0].limits[0].label = evil.into();
    report.plots[0].regions[0].label = evil.into();
    let replay = report.replay.as_mut().unwrap();
    replay.actors[0].name = evil.into();
    replay.actors[0].arrows[0].name = evil.into();
    replay.events[0].label = evil.into();

    let html = report.html();
    assert!(!html.contains("<script>alert"));
    // The page's own: one with data, one with code.
    assert_eq!(html.matches("</script>").count(), 2);
    assert_eq!(html.matches("&lt;/script&gt;&lt;script&gt;alert(&#39;{{data}}&#39;)").count(), 10);
    // What the scripts read is still the text that was put in.
    let data = data_of(&html);
    assert_eq!(data["plots"][0]["title"], evil);
    assert_eq!(data["replay"]["events"][0][1], evil);
}

fn data_of(html: &str) -> serde_json::Value {
    let (_, after) = html.split_once("id=\"data\">").unwrap();
    let (json, _) = after.split_once("</script>").unwrap();
    serde_json::from_str(json).unwrap()
}

#[test]
fn poses_read_back() {
    use base64::Engine as _;
    let data = data_of(&report().html());
    let text = data["replay"]["actors"][0]["parts"][0]["poses"].as_str().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
    let floats: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    assert_eq!(floats.len(), 20 * 7);
    assert_eq!(floats[7 * 19..], [0.19, 0.0, 0.11, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(data["plots"][0]["series"][0]["y"][3], 0.0009);
}

#[test]
fn gaps_are_null() {
    let mut report = report();
    report.plots[0].series[0] = Series::points("gap", vec![[0.0, 1.0], [0.1, f64::NAN], [0.2, 2.0]]);
    report.check().unwrap();
    let points = &data_of(&report.html())["plots"][0]["series"][0]["points"];
    assert!(points[1][1].is_null());
    assert_eq!(points[2][1], 2.0);
}

#[test]
fn same_input_gives_same_bytes() {
    assert_eq!(report().html(), report().html());
}

#[test]
fn an_empty_report_is_a_page() {
    let report = Report::default();
    report.check().unwrap();
    let html = report.html();
    assert!(!html.contains("<canvas") && !html.contains("class=\"plots\""));
}

#[test]
fn saving_writes_the_page_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kick.html");
    std::fs::write(&path, "old").unwrap();
    report().save(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), report().html());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_place_that_cannot_be_written_is_named_and_left_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    // A file where the folder should be: refused for every user, root too.
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").unwrap();
    let path = file.join("kick.html");
    let error = report().save(&path).unwrap_err();
    assert!(matches!(&error, ReportError::Write { path: named, .. } if *named == path));
    assert!(error.to_string().contains("kick.html"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");

    // The target is a folder: the rename fails after the temporary file was written, which must go again.
    let taken = folder.path().join("taken.html");
    std::fs::create_dir(&taken).unwrap();
    std::fs::write(taken.join("inside"), "").unwrap();
    report().save(&taken).unwrap_err();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn what_does_not_fit_is_named() {
    type Spoil = fn(&mut Report);
    let cases: [(Spoil, &str); 12] = [
        (
            |r| {
                r.tables[0].rows[0].pop();
            },
            "table \"Measures\", row 1: 1 cells; wanted 2, one for each column",
        ),
        (
            |r| r.replay.as_mut().unwrap().actors[0].parts[0].poses.truncate(5),
            "replay actor \"Ball\", part 0: 5 frames; wanted 20, one for each time, or 1 if it never moves",
        ),
        (
            |r| r.replay.as_mut().unwrap().actors[0].parts[0].poses[3].rotation = [0.0; 4],
            "replay actor \"Ball\", part 0, frame 3",
        ),
        (
            |r| r.replay.as_mut().unwrap().actors[0].arrows[0].frames[0].vector[1] = f32::NAN,
            "replay actor \"Ball\", arrow \"force\", frame 0",
        ),
        (
            |r| r.replay.as_mut().unwrap().actors[0].arrows[0].metres_per_unit = f32::NAN,
            "replay actor \"Ball\", arrow \"force\": NaN metres per unit; wanted a finite scale",
        ),
        (
            |r| r.replay.as_mut().unwrap().actors[0].offset[2] = f32::NAN,
            "replay actor \"Ball\", offset: [0.0, 0.0, NaN]; wanted finite numbers",
        ),
        (
            |r| {
                r.replay.as_mut().unwrap().camera =
                    Some(Camera { target: [0.0; 3], distance: 0.0, azimuth: 0.0, elevation: 0.0 })
            },
            "replay.camera: Camera {",
        ),
        (|r| r.replay.as_mut().unwrap().times[4] = 0.0, "replay.times: value 4 is 0, after 0.03"),
        (|r| r.replay.as_mut().unwrap().times.clear(), "replay.times: no frame"),
        (|r| r.plots[0].series[0].samples = Samples::Shared(vec![1.0]), "plot \"Height\", series \"ball\": 1 values"),
        (|r| r.plots[0].limits[0].value = f64::INFINITY, "plot \"Height\", limit \"limit\": inf"),
        (|r| r.plots[0].regions[0].to = f64::NAN, "plot \"Height\", region \"swing\""),
    ];
    for (spoil, wanted) in cases {
        let mut report = report();
        spoil(&mut report);
        let error = report.check().unwrap_err().to_string();
        assert!(error.starts_with(wanted), "{error:?} does not start with {wanted:?}");
        // Even so there is a page to look at.
        assert!(report.html().ends_with("</html>\n"));
    }
}
