//! Files appear whole or not at all, and never over others.

use posefuse_export::{ExportError, Format, Options, export};

use crate::take::{Exported, FIRST, SECOND, crowd, names_in, walk};

#[test]
fn nothing_is_written_over_and_nothing_is_left_half_written() {
    let take = walk();
    let options = Options {
        formats: vec![Format::Trc, Format::Bvh],
        people: vec![FIRST],
        ..Options::default()
    };
    let exported = Exported::of(&take, &options);
    let folder = exported.folder.path();
    std::fs::remove_file(exported.path("walk-person3.trc")).unwrap();
    let again = export(&take, &options, folder, false, &mut |_| {});
    assert!(matches!(&again, Err(ExportError::Exists(path)) if path.ends_with("walk-person3.bvh")));
    assert_eq!(
        names_in(folder),
        ["walk-person3.bvh"],
        "refused before anything is written"
    );
    // A file cannot take the place of a folder.
    let blocked = exported.path("walk-person3.bvh");
    std::fs::remove_file(&blocked).unwrap();
    std::fs::create_dir(&blocked).unwrap();
    let result = export(&take, &options, folder, true, &mut |_| {});
    assert!(matches!(&result, Err(ExportError::Write { path, .. }) if *path == blocked));
    assert_eq!(
        names_in(folder),
        ["walk-person3.bvh", "walk-person3.trc"],
        "what was finished before stays, nothing half written does"
    );
    std::fs::remove_dir(&blocked).unwrap();
    let mut steps = Vec::new();
    let report = export(&take, &options, folder, true, &mut |step| steps.push(step)).unwrap();
    assert_eq!(names_in(folder), ["walk-person3.bvh", "walk-person3.trc"]);
    assert!(steps.iter().all(|step| step.done <= step.total));
    for file in &report.files {
        assert_eq!(file.bytes, std::fs::metadata(&file.path).unwrap().len());
        assert_eq!(file.from_utc, "2026-09-21T14:15:00.000000Z");
        assert_eq!(
            (file.from_timecode.as_str(), file.timecode_rate.as_str()),
            ("14:15:00:00", "30")
        );
    }
}

#[test]
fn whoever_asks_for_nobody_is_told_who_there_is() {
    let take = walk();
    let folder = tempfile::tempdir().unwrap();
    let refusal = |options: Options| {
        let result = export(&take, &options, folder.path(), false, &mut |_| {});
        result.unwrap_err().to_string()
    };
    let usual = Options::of_format(Format::Csv);
    let nobody = refusal(Options {
        people: vec![99],
        ..usual.clone()
    });
    assert!(nobody.contains("person3, person8"), "{nobody}");
    let short = refusal(Options {
        least_s: 60.0,
        ..usual.clone()
    });
    assert!(short.contains("--least"), "{short}");
    let late = refusal(Options {
        from_s: Some(500.0),
        ..usual
    });
    assert!(late.contains("no frame"), "{late}");
    assert!(names_in(folder.path()).is_empty());
}

#[test]
fn a_piece_of_a_take_is_what_the_whole_has_there_however_short() {
    let take = walk();
    let whole = Exported::of(&take, &Options::of_format(Format::Csv)).text("walk.csv");
    let piece = Options {
        from_s: Some(7.0),
        to_s: Some(7.3),
        ..Options::of_format(Format::Csv)
    };
    let piece = Exported::of(&take, &piece);
    assert_eq!(
        piece.report.people.len(),
        2,
        "there for much longer than it"
    );
    let text = piece.text("walk.csv");
    assert_eq!(text.lines().count(), 1 + 2 * 10);
    // Frames count from the piece's begin, everything else is as in the whole.
    let rest = |row: &str| row.split_once(',').unwrap().1.to_owned();
    let whole: Vec<String> = whole.lines().map(rest).collect();
    assert!(text.lines().all(|row| whole.contains(&rest(row))));
    let short = Options {
        people: vec![SECOND],
        least_s: 8.0,
        ..Options::of_format(Format::Csv)
    };
    let folder = tempfile::tempdir().unwrap();
    let result = export(&take, &short, folder.path(), false, &mut |_| {});
    assert!(result.unwrap_err().to_string().contains("--least"));
}

#[test]
fn more_files_than_can_be_open_are_refused_before_anything_is_written() {
    let take = crowd(300);
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        least_s: 0.0,
        ..Options::of_format(Format::Trc)
    };
    let result = export(&take, &options, folder.path(), false, &mut |_| {});
    let refusal = result.unwrap_err().to_string();
    for word in ["300 files", "--person", "--least"] {
        assert!(refusal.contains(word), "{refusal}");
    }
    assert!(names_in(folder.path()).is_empty());
    let one_file = Options {
        formats: vec![Format::Csv],
        ..options
    };
    let exported = Exported::of(&take, &one_file);
    assert_eq!(exported.report.people.len(), 300);
}
