//! The same seed gives the same run of the simulated network. A process of its own: tokio numbers tasks through the
//! whole process, so that labs on other threads would change the order in which a crashed host's tasks end.

use std::time::Duration;

use posefuse_agent::AgentReport;
use posefuse_tests::simulated::{Entry, Lab, Plan};

const S: Duration = Duration::from_secs(1);

/// A bad network and a server that is killed and comes back: everything that everybody saw, and how agents ended.
fn run(seed: u64) -> (Vec<Entry>, Vec<AgentReport>) {
    let mut lab = Lab::new(&Plan {
        max_latency: Duration::from_millis(60),
        loss: 0.001,
        repair: 0.1,
        ..Plan::new(seed, 2)
    });
    lab.start_agents(8.0);
    lab.run_for(3 * S);
    lab.crash_server();
    lab.run_for(S);
    lab.start_server();
    let reports = lab.until_agents_end(30 * S);
    (lab.log().entries(), reports)
}

#[test]
fn the_same_seed_gives_the_same_trace() {
    let mut traces = Vec::new();
    for seed in 1..=6 {
        let (first, reports) = run(seed);
        let (again, reports_again) = run(seed);
        assert!(first.len() > 500, "{} entries", first.len());
        for (index, (one, other)) in first.iter().zip(&again).enumerate() {
            assert_eq!(
                one, other,
                "seed {seed}: entry {index} of the trace differs"
            );
        }
        assert_eq!((first.len(), reports), (again.len(), reports_again));
        assert!(
            !traces.contains(&first),
            "the trace does not depend on the seed"
        );
        traces.push(first);
    }
}
