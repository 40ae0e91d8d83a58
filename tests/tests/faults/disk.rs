//! A disk that fills up while a take is recorded. Needs root and a file system of a chosen size; skipped without.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use posefuse_proto::v1::TakeState;
use posefuse_tests::account::observations;
use posefuse_tests::process::{Follower, Room};
use tokio::time::{Instant, sleep};

/// A file system of its own size that goes with this.
struct Mount(tempfile::TempDir);

impl Mount {
    /// `Err` says why there can be none.
    fn of_mib(size: u32) -> Result<Self, String> {
        if !rustix::process::geteuid().is_root() {
            return Err("mounting a small file system needs root".to_owned());
        }
        let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
        let size = format!("size={size}m");
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs"])
            .arg(folder.path())
            .output();
        let mount = mount.map_err(|error| format!("mount: {error}"))?;
        if !mount.status.success() {
            return Err(String::from_utf8_lossy(&mount.stderr).trim().to_owned());
        }
        Ok(Self(folder))
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0.path()).status();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_ends_the_take_in_order_and_nothing_else() {
    let mount = match Mount::of_mib(24) {
        Ok(mount) => mount,
        Err(why) => {
            println!("SKIPPED: no disk that can be filled: {why}");
            return;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let room = Room::with_takes(2, folder, mount.path().join("takes")).await;
    let _agents = room.agents().await;
    let follower = Follower::new(&room).await;
    room.start_take("full").await;
    sleep(Duration::from_millis(1500)).await;

    // Another program takes all that is left.
    let ballast = mount.path().join("ballast");
    let filled = std::io::copy(
        &mut std::io::repeat(1),
        &mut std::fs::File::create(&ballast).unwrap(),
    );
    assert_eq!(filled.unwrap_err().kind(), std::io::ErrorKind::StorageFull);
    let full = Instant::now();
    let status = room
        .status_when("the take has ended by itself", |status| {
            status.recording.is_none()
        })
        .await;
    println!(
        "ended {:?} after the disk was full: {:?}",
        full.elapsed(),
        status.troubles
    );
    assert!(
        status
            .troubles
            .iter()
            .any(|trouble| trouble.contains("`full`")),
        "{:?}",
        status.troubles
    );

    let listed = room.listed("full").await;
    assert_eq!(listed.state(), TakeState::Complete, "{listed:?}");
    let take = room.take("full");
    let frames: Vec<_> = take.frames().map(Result::unwrap).collect();
    assert!(
        frames.len() >= 20
            && frames
                .windows(2)
                .all(|pair| pair[0].number + 1 == pair[1].number)
    );
    assert_eq!(frames.len() as u64, listed.frames);
    for (sensor, observations) in observations(&take) {
        let gapless = observations
            .windows(2)
            .all(|pair| pair[0].sequence + 1 == pair[1].sequence);
        assert!(gapless, "{sensor}: a hole in the take");
    }

    let from = Instant::now();
    sleep(Duration::from_secs(1)).await;
    assert!(follower.since(from).len() > 20, "fusion has stopped");
    follower.complete();
    std::fs::remove_file(ballast).unwrap();
    room.status_when("there is room again", |status| {
        status.disk_free_bytes > 4_000_000
    })
    .await;
    room.start_take("again").await;
    sleep(Duration::from_secs(1)).await;
    assert!(room.stop_take().await.frames > 10);
}
