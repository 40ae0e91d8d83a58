//! Files appear whole or not at all, and never over others.

use posefuse_export::{ExportError, Format, Options, export};

use crate::take::{Exported, FIRST, names_in, walk};

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
    let mut steps = Vec::new();
    let report = export(&take, &options, folder, true, &mut |step| steps.push(step)).unwrap();
    assert_eq!(names_in(folder), ["walk-person3.bvh", "walk-person3.trc"]);
    assert!(steps.iter().all(|step| step.done <= step.total));
    for file in &report.files {
        assert_eq!(file.bytes, std::fs::metadata(&file.path).unwrap().len());
        assert_eq!(file.from_utc, "2026-09-21T14:15:00.000000Z");
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
