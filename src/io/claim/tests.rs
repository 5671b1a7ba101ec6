//! Claims: one owner at any time, taken over only if that is allowed.

use super::*;

const LONG: Duration = Duration::from_secs(600);

fn mine(folder: &Path, takeover: Duration, watch: &mut Watch) -> Option<Claim> {
    match take(folder, takeover, watch).expect("looked") {
        Taken::Mine(claim) => Some(claim),
        Taken::Held { .. } => None,
    }
}

fn now(folder: &Path) -> Option<Claim> {
    mine(folder, LONG, &mut Watch::default())
}

/// Writes a claim as another machine leaves it, whose locks cannot be seen here.
fn leave(folder: &Path, number: u64, beats: u64, takeover: Duration, given_back: bool) {
    let claims = folder.join(FOLDER);
    fs::create_dir_all(&claims).expect("folder");
    let here = Owner::here(takeover);
    let owner = Owner { host: "node7".into(), machine: "another".into(), locked: true, beats, given_back, ..here };
    let mut file = File::create(claims.join(format!("{number:06}.json"))).expect("file");
    owner.write(&mut file).expect("written");
}

#[test]
fn a_folder_has_one_owner_until_it_is_given_back() {
    let folder = tempfile::tempdir().expect("folder");
    assert_eq!(holder(folder.path()).expect("looked"), None);
    let first = now(folder.path()).expect("free");
    assert!(now(folder.path()).is_none());
    let by = holder(folder.path()).expect("looked").expect("held");
    assert!(by.contains(&std::process::id().to_string()), "{by}");
    assert_eq!((first.number(), first.is_lost()), (1, false));
    drop(first);
    assert_eq!(holder(folder.path()).expect("looked"), None);
    let second = now(folder.path()).expect("free again");
    assert_eq!(second.number(), 2);
    second.forget_earlier();
    assert!(!second.is_lost() && now(folder.path()).is_none());
}

/// The lock of a dead process is free, so no process on its machine waits for its heartbeat.
#[test]
fn a_dead_owner_of_this_machine_is_followed_at_once() {
    let folder = tempfile::tempdir().expect("folder");
    leave(folder.path(), 1, 5, LONG, false);
    assert!(now(folder.path()).is_none(), "of another machine: only its heartbeat tells");
    let path = folder.path().join(FOLDER).join("000001.json");
    let write = |locked| {
        let mut file = OpenOptions::new().write(true).open(&path).expect("open");
        Owner { locked, ..Owner::here(LONG) }.write(&mut file).expect("written");
    };
    write(false);
    assert!(now(folder.path()).is_none(), "it could not lock, so its lock tells nothing");
    write(true);
    let file = File::open(&path).expect("open");
    file.try_lock().expect("locked");
    assert!(now(folder.path()).is_none(), "it lives");
    drop(file);
    assert_eq!(now(folder.path()).expect("dead").number(), 2);
}

#[test]
fn an_owner_elsewhere_is_followed_once_its_heartbeat_stands_still() {
    let folder = tempfile::tempdir().expect("folder");
    let short = Duration::from_millis(60);
    leave(folder.path(), 3, 5, short, false);
    let mut watch = Watch::default();
    // The timeout of the claim counts, not that of the waiting process.
    assert!(mine(folder.path(), Duration::ZERO, &mut watch).is_none(), "not watched yet");
    std::thread::sleep(2 * short);
    leave(folder.path(), 3, 6, short, false);
    assert!(mine(folder.path(), LONG, &mut watch).is_none(), "it has beaten");
    assert!(watch.beating);
    std::thread::sleep(2 * short);
    assert_eq!(mine(folder.path(), LONG, &mut watch).expect("it stands still").number(), 4);

    let folder = tempfile::tempdir().expect("folder");
    leave(folder.path(), 1, 5, LONG, true);
    assert_eq!(now(folder.path()).expect("given back").number(), 2);

    // Killed between creating the file and writing into it.
    let folder = tempfile::tempdir().expect("folder");
    fs::create_dir_all(folder.path().join(FOLDER)).expect("folder");
    fs::write(folder.path().join(FOLDER).join("000001.json"), "").expect("written");
    let mut watch = Watch::default();
    assert!(mine(folder.path(), short, &mut watch).is_none());
    std::thread::sleep(2 * short);
    assert!(mine(folder.path(), short, &mut watch).is_some());
}

#[test]
fn a_heart_beats_until_another_has_taken_over() {
    let folder = tempfile::tempdir().expect("folder");
    let short = Duration::from_millis(120);
    let claim = mine(folder.path(), short, &mut Watch::default()).expect("free");
    let path = folder.path().join(FOLDER).join("000001.json");
    let before = fs::read(&path).expect("read");
    let lost = claim.lost();
    let wait = |what: &dyn Fn() -> bool| {
        let end = Instant::now() + Duration::from_secs(60);
        while !what() {
            assert!(Instant::now() < end, "in vain");
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    wait(&|| fs::read(&path).expect("read") != before);
    assert!(!lost.load(Ordering::SeqCst));
    leave(folder.path(), 2, 0, LONG, false);
    wait(&|| lost.load(Ordering::SeqCst));
    assert!(claim.is_lost());
    drop(claim);
    assert!(now(folder.path()).is_none(), "what was lost is not given back");
}

/// Of many processes that take over at once, one succeeds.
#[test]
fn of_many_who_take_over_at_once_one_succeeds() {
    let folder = tempfile::tempdir().expect("folder");
    for round in 1..40 {
        leave(folder.path(), round, 0, LONG, true);
        let start = std::sync::Barrier::new(8);
        let won: Vec<Claim> = std::thread::scope(|scope| {
            let racer = || {
                start.wait();
                now(folder.path())
            };
            let racers: Vec<_> = (0..8).map(|_| scope.spawn(racer)).collect();
            racers.into_iter().filter_map(|r| r.join().expect("raced")).collect()
        });
        assert_eq!(won.iter().map(Claim::number).collect::<Vec<_>>(), [round + 1]);
        drop(won);
    }
}
