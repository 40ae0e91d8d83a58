use posefuse_skeleton::SensorId;
use proptest::prelude::*;

use super::*;

const START_NS: i64 = 5_000_000_000_000;

/// An agent's clock: `shows(server time)`.
#[derive(Clone, Copy)]
struct Agent {
    offset_ns: i64,
    drift_ppm: f64,
}

impl Agent {
    fn shows(&self, server_ns: i64) -> AgentTime {
        let gained = (server_ns - START_NS) as f64 * self.drift_ppm * 1e-6;
        AgentTime::from_ns(server_ns + self.offset_ns + gained.round() as i64)
    }

    fn answer(&self, sent_ns: i64, there_ns: i64, back_ns: i64) -> ClockSample {
        let arrived = sent_ns + there_ns;
        ClockSample {
            sensor: SensorId::new(0).unwrap(),
            sent: Timestamp::from_ns(sent_ns),
            returned: Timestamp::from_ns(arrived + 30_000 + back_ns),
            agent_received: self.shows(arrived),
            agent_sent: self.shows(arrived + 30_000),
        }
    }
}

fn ms(ms: i64) -> i64 {
    ms * 1_000_000
}

fn config() -> ClockConfig {
    ClockConfig::default()
}

/// A filter that has followed `agent` for `seconds`, one probe each half second.
fn followed(agent: Agent, seconds: i64) -> ClockFilter {
    let mut filter = ClockFilter::default();
    for half in 0..seconds * 2 {
        let there = 500_000 + (half * 7919 % 13) * 100_000;
        let back = 400_000 + (half * 104_729 % 11) * 150_000;
        filter.add(
            &agent.answer(START_NS + half * ms(500), there, back),
            &config(),
        );
    }
    filter
}

/// A frame captured at server time `at_ns` and received 20 ms later.
fn frame(filter: &mut ClockFilter, agent: Agent, at_ns: i64) -> Mapped {
    filter.map_frame(
        agent.shows(at_ns),
        Timestamp::from_ns(at_ns + ms(20)),
        &config(),
    )
}

#[test]
fn nothing_is_mapped_before_the_first_answer() {
    let agent = Agent {
        offset_ns: 0,
        drift_ppm: 0.0,
    };
    let mut filter = ClockFilter::default();
    assert_eq!(frame(&mut filter, agent, START_NS), Mapped::Unknown);
    assert!(
        filter
            .estimate(Timestamp::from_ns(START_NS), &config())
            .is_none()
    );
    assert_eq!(filter.map(AgentTime::ZERO), None);
}

#[test]
fn drift_is_found_once_the_window_is_long_enough() {
    let agent = Agent {
        offset_ns: ms(123_456),
        drift_ppm: 80.0,
    };
    let at = |seconds: i64| Timestamp::from_ns(START_NS + ms(1000) * seconds);
    let early = followed(agent, 5).estimate(at(5), &config()).unwrap();
    assert_eq!(early.drift_ppm, 0.0);
    let late = followed(agent, 60).estimate(at(60), &config()).unwrap();
    assert!((late.drift_ppm + 80.0).abs() < 5.0, "{late:?}");
}

#[test]
fn a_step_is_seen_at_once_and_followed_at_the_second_answer() {
    for step_ns in [ms(30_000), ms(-30_000), ms(-3_600_000), ms(400), ms(-400)] {
        let before = Agent {
            offset_ns: ms(-777),
            drift_ppm: 20.0,
        };
        let mut filter = followed(before, 20);
        let mut now = START_NS + ms(20_000);
        assert!(matches!(frame(&mut filter, before, now), Mapped::At(_)));
        let after = Agent {
            offset_ns: before.offset_ns + step_ns,
            ..before
        };
        let mut in_step_after = None;
        for half in 0..6 {
            now += ms(500);
            filter.add(&after.answer(now, 900_000, 700_000), &config());
            // Either the frame is held back or its stamp is right.
            match frame(&mut filter, after, now + ms(5)) {
                Mapped::At(time) => {
                    let off_ns = time.ns() - (now + ms(5));
                    assert!(off_ns.abs() < ms(3), "step {step_ns}: off by {off_ns} ns");
                    in_step_after.get_or_insert(half);
                }
                Mapped::Stepped => {
                    let estimate = filter.estimate(Timestamp::from_ns(now), &config()).unwrap();
                    assert!(
                        estimate.suspect,
                        "step {step_ns} not detected by the first answer"
                    );
                }
                Mapped::Unknown => panic!("a known clock became unknown"),
            }
        }
        assert_eq!(in_step_after, Some(1), "step {step_ns}");
        assert_eq!(
            filter
                .estimate(Timestamp::from_ns(now), &config())
                .unwrap()
                .steps,
            1
        );
    }
}

#[test]
fn frames_from_the_future_and_frames_faster_than_ever_are_held_back() {
    let agent = Agent {
        offset_ns: 0,
        drift_ppm: 0.0,
    };
    let mut filter = followed(agent, 20);
    let now = START_NS + ms(20_000);
    // Usually 400 ms under way.
    for frame in 0..20 {
        let at = now + ms(33) * frame;
        let received = Timestamp::from_ns(at + ms(400));
        assert!(matches!(
            filter.map_frame(agent.shows(at), received, &config()),
            Mapped::At(_)
        ));
    }
    let stepped = Agent {
        offset_ns: ms(300),
        drift_ppm: 0.0,
    };
    let at = now + ms(700);
    let received = Timestamp::from_ns(at + ms(400));
    assert_eq!(
        filter.map_frame(stepped.shows(at), received, &config()),
        Mapped::Stepped
    );
    let stepped = Agent {
        offset_ns: ms(500),
        drift_ppm: 0.0,
    };
    assert_eq!(
        filter.map_frame(stepped.shows(at), received, &config()),
        Mapped::Stepped
    );
    // An answer that agrees shows that only the road got faster.
    let received = Timestamp::from_ns(at + ms(50));
    assert_eq!(
        filter.map_frame(agent.shows(at), received, &config()),
        Mapped::Stepped
    );
    filter.add(&agent.answer(at + ms(500), 500_000, 500_000), &config());
    let received = Timestamp::from_ns(at + ms(700));
    assert!(matches!(
        filter.map_frame(agent.shows(at + ms(650)), received, &config()),
        Mapped::At(_)
    ));
}

#[test]
fn one_lying_answer_changes_nothing() {
    let agent = Agent {
        offset_ns: 0,
        drift_ppm: 0.0,
    };
    let mut filter = followed(agent, 20);
    let liar = Agent {
        offset_ns: ms(5000),
        drift_ppm: 0.0,
    };
    let now = START_NS + ms(20_000);
    filter.add(&liar.answer(now, 500_000, 500_000), &config());
    assert_eq!(frame(&mut filter, agent, now + ms(10)), Mapped::Stepped);
    filter.add(&agent.answer(now + ms(500), 500_000, 500_000), &config());
    assert!(matches!(
        frame(&mut filter, agent, now + ms(510)),
        Mapped::At(_)
    ));
    assert_eq!(
        filter
            .estimate(Timestamp::from_ns(now), &config())
            .unwrap()
            .steps,
        0
    );
}

#[test]
fn impossible_answers_are_counted_and_not_used() {
    let agent = Agent {
        offset_ns: 0,
        drift_ppm: 0.0,
    };
    let mut filter = followed(agent, 2);
    let good = agent.answer(START_NS + ms(9000), 500_000, 500_000);
    for bad in [
        ClockSample {
            returned: good.sent.plus_ns(-1),
            ..good
        },
        ClockSample {
            agent_sent: good.agent_received.plus_ns(-1),
            ..good
        },
        ClockSample {
            agent_received: AgentTime::from_ns(i64::MIN),
            ..good
        },
        ClockSample {
            sent: Timestamp::from_ns(i64::MIN),
            ..good
        },
    ] {
        filter.add(&bad, &config());
    }
    assert_eq!(filter.refused(), 4);
}

proptest! {
    #[test]
    fn the_true_offset_lies_within_the_bound(
        offset_ns in -1_000_000_000_000_i64..1_000_000_000_000,
        drift_ppm in -100.0..100.0_f64,
        delays in prop::collection::vec((50_000_i64..20_000_000, 50_000_i64..20_000_000), 1..80),
        ahead_ms in 0_i64..2000,
    ) {
        let agent = Agent { offset_ns, drift_ppm };
        let mut filter = ClockFilter::default();
        let mut now = START_NS;
        for (there, back) in delays {
            now += ms(500);
            filter.add(&agent.answer(now, there, back), &config());
            let at = now + ms(ahead_ms);
            let estimate = filter.estimate(Timestamp::from_ns(at), &config()).unwrap();
            let off_ns = filter.map(agent.shows(at)).unwrap().ns() - at;
            prop_assert!(off_ns.abs() <= estimate.error_ns + 1000, "{off_ns} ns off, {estimate:?}");
            prop_assert_eq!(estimate.steps, 0);
        }
    }
}

#[test]
fn an_answer_that_comes_again_is_no_second_vote() {
    let agent = Agent {
        offset_ns: ms(50),
        drift_ppm: 0.0,
    };
    let stepped = Agent {
        offset_ns: ms(2_050),
        ..agent
    };
    let mut filter = followed(agent, 10);
    let later = START_NS + ms(10_500);
    let odd = stepped.answer(later, 500_000, 500_000);
    let older = stepped.answer(later - ms(100), 500_000, 500_000);
    for again in [&odd, &odd, &older, &odd] {
        filter.add(again, &config());
    }
    let now = Timestamp::from_ns(later + ms(5));
    let estimate = filter.estimate(now, &config()).unwrap();
    assert_eq!(
        estimate.steps, 0,
        "one answer, told four times, made a step"
    );
    assert!(estimate.suspect);
    assert_eq!(filter.refused(), 3);
    filter.add(&stepped.answer(later + ms(20), 500_000, 500_000), &config());
    assert_eq!(filter.estimate(now, &config()).unwrap().steps, 1);
}
