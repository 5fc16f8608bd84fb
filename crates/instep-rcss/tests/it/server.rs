//! The real server: a player joins, walks to the ball and plays it toward the goal; another with its number is refused; when the
//! server dies and comes again, so does the player.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use instep_rcss::RcssError;

use crate::support::{Server, play, port, setup};

#[test]
fn a_player_joins_walks_to_the_ball_and_plays_it_forward() {
    let server = Server::start(port());
    let stop = AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        let player = scope.spawn(|| play(&setup(server.port, 14.0), "Instep", &[2], &stop));
        std::thread::sleep(Duration::from_secs(2));
        // In the middle of the play, as a monitor may: the ball a step ahead of where the player was put.
        server.tell(&["(kickOff Left)", "(playMode PlayOn)"]);
        player.join().unwrap()
    });
    let tally = &result.0.unwrap()[0];
    let last = tally.records.last().unwrap();
    println!("{} cycles, {:.2} ms each; {last:?}", tally.cycles, tally.mean_ms);
    assert!(tally.cycles >= 600, "{tally:?}");
    assert_eq!((tally.late_cycles, tally.malformed, tally.fell, tally.reconnects), (0, 0, 0, 0), "{tally:?}");
    // It knows where it is by landmarks alone, whatever the server tells.
    let off = last.by_landmarks.distance(&last.told);
    assert!(off < 0.3, "by landmarks {:?}, told {:?}", last.by_landmarks, last.told);
    assert!(last.record.ball_position[0] > 0.5, "the ball lies at {:?}", last.record.ball_position);
}

#[test]
fn a_second_player_with_the_number_is_refused_and_a_server_that_comes_again_is_joined_again() {
    let port = port();
    let server = Server::start(port);
    let stop = AtomicBool::new(false);
    let (result, said) = std::thread::scope(|scope| {
        let player = scope.spawn(|| play(&setup(port, 1e5), "Instep", &[3], &stop));
        std::thread::sleep(Duration::from_secs(2));
        let (second, _) = play(&setup(port, 1.0), "Instep", &[3], &AtomicBool::new(false));
        assert!(matches!(second, Err(RcssError::Refused { number: 3, .. })), "{second:?}");
        drop(server);
        let again = Server::start(port);
        std::thread::sleep(Duration::from_secs(3));
        stop.store(true, Ordering::Relaxed);
        let result = player.join().unwrap();
        drop(again);
        result
    });
    let tally = &result.unwrap()[0];
    assert_eq!(tally.reconnects, 1, "{said:?}");
    assert!(said.iter().any(|line| line.contains("plays again")), "{said:?}");
}
