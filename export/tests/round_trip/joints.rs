//! Tables, TRC and C3D: the joints as they were in the take.

use posefuse_export::{Axes, Format, Options, Preset, Source, Unit};
use posefuse_skeleton::{JOINT_COUNT, Joint, JointState, Provenance};

use crate::take::{
    Exported, FIRST, FRAMES, SECOND, SECOND_IS_LOST, SECOND_IS_THERE, START, UNIX_OFFSET_NS,
    skeletons, time, walk, walk_in_which,
};

#[test]
fn a_wide_table_has_every_joint_where_it_was_and_no_row_for_who_is_not_there() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_format(Format::Csv));
    assert_eq!(exported.report.rate_hz, 30.0);
    let text = exported.text("walk.csv");
    let mut rows = text.lines();
    let head: Vec<&str> = rows.next().unwrap().split(',').collect();
    assert_eq!(head.len(), 5 + 5 * JOINT_COUNT + 2);
    assert_eq!(head[5 + 5 * JOINT_COUNT..], ["hand_left", "hand_right"]);
    assert_eq!(head[5 + 5 * Joint::Head as usize], "Head_x_m");
    let sent = [skeletons(&take, FIRST), skeletons(&take, SECOND)];
    let mut counts = [0; 2];
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let frame: usize = cells[0].parse().unwrap();
        let person = usize::from(cells[4] == format!("person{SECOND}"));
        counts[person] += 1;
        let seconds: f64 = cells[1].parse().unwrap();
        assert!((seconds - time(frame).since_seconds(START)).abs() < 1e-6);
        assert_eq!(cells[2].parse(), Ok(time(frame).ns() + UNIX_OFFSET_NS));
        assert!(
            cells[3].starts_with("14:15:") && cells[3].ends_with(&format!(":{:02}", frame % 30))
        );
        let skeleton = sent[person][frame].as_ref().unwrap();
        for (joint, state) in skeleton.iter() {
            let cell = |axis: usize| cells[5 + 5 * joint as usize + axis].parse::<f64>().unwrap();
            for axis in 0..3 {
                assert!(
                    (cell(axis) - state.position.vector()[axis]).abs() < 1e-6,
                    "{row}"
                );
            }
        }
    }
    let there = SECOND_IS_THERE.count() - SECOND_IS_LOST.len();
    assert_eq!(counts, [FRAMES, there]);
    let second = &exported.report.people[1];
    assert_eq!(second.frames_without, SECOND_IS_LOST.len() as u64);
    assert_eq!((second.from_s, second.to_s), (2.0, 8.0));
}

#[test]
fn made_up_joints_say_so_and_are_left_out_where_only_measured_ones_are_wanted() {
    // The left hand is made up throughout.
    let take = walk_in_which(|_, _, skeleton| {
        skeleton.map(|joint, state| JointState {
            provenance: match joint {
                Joint::HandLeft => Provenance::Repaired,
                _ => state.provenance,
            },
            ..*state
        })
    });
    let how = 5 + 5 * Joint::HandLeft as usize + 4;
    for (only_measured, expected) in [(false, "repaired"), (true, "")] {
        let options = Options {
            only_measured,
            people: vec![FIRST, 77],
            ..Options::of_format(Format::Csv)
        };
        let exported = Exported::of(&take, &options);
        assert_eq!(exported.report.absent, [77]);
        let text = exported.text("walk.csv");
        assert!(text.lines().next().unwrap().split(',').nth(how) == Some("HandLeft_provenance"));
        assert_eq!(text.lines().count(), 1 + FRAMES);
        for row in text.lines().skip(1) {
            let cells: Vec<&str> = row.split(',').collect();
            assert_eq!(cells[how], expected);
            assert_eq!(cells[how - 4].is_empty(), only_measured);
            assert_eq!(cells[5 + 4], "measured");
        }
    }
}

#[test]
fn a_tidy_table_for_unreal_is_left_handed_and_in_centimetres() {
    let take = walk();
    let options = Options {
        formats: vec![Format::CsvTidy],
        people: vec![FIRST],
        to_s: Some(1.0),
        ..Options::of_preset(Preset::Unreal)
    };
    let exported = Exported::of(&take, &options);
    let text = exported.text("walk.tidy.csv");
    assert!(text.starts_with(
        "frame,time_s,unix_ns,timecode,person,joint,x_cm,y_cm,z_cm,sigma_cm,confidence,provenance,hand\n"
    ));
    let sent = skeletons(&take, FIRST);
    let mut rows = 0;
    for row in text.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |cell: usize| cells[cell].parse::<f64>().unwrap();
        let skeleton = sent[number(0) as usize].as_ref().unwrap();
        let at = skeleton
            .position(cells[5].parse().unwrap())
            .unwrap()
            .vector()
            * 100.0;
        let off = [number(6) - at.x, number(7) + at.y, number(8) - at.z];
        assert!(off.iter().all(|off| off.abs() < 1e-3), "{row}");
        assert!((number(9) - 0.2).abs() < 1e-3 && cells[11] == "measured");
        rows += 1;
    }
    assert_eq!(rows, 31 * JOINT_COUNT);
}

#[test]
fn a_trc_for_opensim_has_nan_where_the_person_was_lost() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_preset(Preset::OpenSim));
    assert_eq!(exported.names(), ["walk-person3.trc", "walk-person8.trc"]);
    let text = exported.text("walk-person8.trc");
    let lines: Vec<&str> = text.lines().collect();
    let frames = SECOND_IS_THERE.count();
    assert_eq!(lines.len(), 5 + frames);
    assert_eq!(
        lines[2],
        format!("30\t30\t{frames}\t25\tmm\t30\t1\t{frames}")
    );
    let sent = skeletons(&take, SECOND);
    for (index, line) in lines[5..].iter().enumerate() {
        let cells: Vec<&str> = line.split('\t').collect();
        assert_eq!(
            (cells.len(), cells[0].parse()),
            (2 + 3 * JOINT_COUNT, Ok(index + 1))
        );
        let Some(skeleton) = &sent[index + SECOND_IS_THERE.start()] else {
            assert!(cells[2..].iter().all(|cell| *cell == "NaN"), "{line}");
            continue;
        };
        for (joint, state) in skeleton.iter() {
            let at = state.position.vector() * 1000.0;
            let cell = |axis: usize| cells[2 + 3 * joint as usize + axis].parse::<f64>().unwrap();
            for (axis, expected) in [at.x, at.z, -at.y].into_iter().enumerate() {
                assert!((cell(axis) - expected).abs() < 1e-3, "{line}");
            }
        }
    }
}

#[test]
fn a_c3d_names_the_points_of_both_and_marks_those_that_are_missing() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_format(Format::C3d));
    let bytes = std::fs::read(exported.path("walk.c3d")).unwrap();
    let word = |number: usize| u16::from_le_bytes([bytes[2 * number - 2], bytes[2 * number - 1]]);
    let points = 2 * JOINT_COUNT;
    assert_eq!(
        (word(2), word(4), word(5)),
        (points as u16, 1, FRAMES as u16)
    );
    let labels = String::from_utf8_lossy(&bytes);
    assert!(labels.contains("person3:SpineBase") && labels.contains("person8:ThumbRight"));
    let begin = 512 * (usize::from(word(9)) - 1);
    assert_eq!(
        bytes.len(),
        (begin + FRAMES * points * 16).next_multiple_of(512)
    );
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    for (person, number) in [FIRST, SECOND].into_iter().enumerate() {
        for (frame, sent) in skeletons(&take, number).iter().enumerate() {
            for joint in Joint::ALL {
                let point = person * JOINT_COUNT + joint as usize;
                let at = begin + 16 * (frame * points + point);
                let Some(position) = sent.as_ref().and_then(|sent| sent.position(joint)) else {
                    assert_eq!(float(at + 12), -1.0);
                    continue;
                };
                assert_eq!(float(at + 12), 2.0, "sigma in mm");
                for axis in 0..3 {
                    let off = f64::from(float(at + 4 * axis)) - 1000.0 * position.vector()[axis];
                    assert!(off.abs() < 1e-3, "person {number} frame {frame} {joint}");
                }
            }
        }
    }
}

#[test]
fn another_rate_and_span_gives_the_motion_between_the_frames() {
    let take = walk();
    let options = Options {
        rate_hz: Some(100.0),
        from_s: Some(1.005),
        to_s: Some(3.0),
        people: vec![FIRST],
        axes: Some(Axes::YUp),
        unit: Some(Unit::Millimetre),
        source: Source::Fused,
        ..Options::of_format(Format::Csv)
    };
    let exported = Exported::of(&take, &options);
    let world = crate::take::world();
    let text = exported.text("walk.csv");
    let (mut worst, mut sum, mut count) = (0f64, 0.0, 0.0);
    assert_eq!(text.lines().count(), 1 + 200);
    for row in text.lines().skip(1) {
        let cells: Vec<f64> = row
            .split(',')
            .map(|cell| cell.parse().unwrap_or(0.0))
            .collect();
        let truth = &world.truth(cells[1])[0].joints;
        for (joint, position) in truth.iter() {
            let (cell, at) = (5 + 5 * joint as usize, position.vector() * 1000.0);
            for (cell, at) in cells[cell..cell + 3].iter().zip([at.y, at.z, at.x]) {
                worst = worst.max((cell - at).abs());
                sum += (cell - at).powi(2);
                count += 1.0;
            }
        }
    }
    // Where a limb starts or stops between two frames, nobody can know when.
    let typical = f64::sqrt(sum / count);
    assert!(
        worst < 2.0 && typical < 0.1,
        "{worst} mm off between frames, {typical} mm RMS"
    );
}
