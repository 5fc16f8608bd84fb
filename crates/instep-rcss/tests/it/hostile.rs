//! Servers that are none, refuse, fall silent or send what cannot be.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use instep_rcss::RcssError;

use crate::support::{play, port, setup};

/// Sends a message as the server does.
fn send(stream: &mut TcpStream, message: &[u8]) {
    let mut bytes = u32::try_from(message.len()).unwrap().to_be_bytes().to_vec();
    bytes.extend_from_slice(message);
    // The player may have gone.
    let _ = stream.write_all(&bytes);
}

/// A server that does `serve` with every connection.
fn listen(serve: impl Fn(TcpStream, usize) + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for (i, stream) in listener.incoming().enumerate() {
            serve(stream.unwrap(), i);
        }
    });
    port
}

#[test]
fn where_nobody_listens_it_says_so_once_and_gives_up() {
    let (result, said) = play(&setup(port(), 1.0), "Instep", &[2], &AtomicBool::new(false));
    assert!(matches!(result, Err(RcssError::Connection { .. })), "{result:?}");
    assert!(said.is_empty(), "{said:?}");
}

#[test]
fn names_and_numbers_that_cannot_be_are_refused_before_anything_is_sent() {
    let stop = AtomicBool::new(false);
    for team in ["", "Two Words", "(init T1 x 1)"] {
        assert!(matches!(play(&setup(1, 1.0), team, &[2], &stop).0, Err(RcssError::Team { .. })));
    }
    assert!(matches!(play(&setup(1, 1.0), "Instep", &[0], &stop).0, Err(RcssError::Number { found: 0 })));
}

#[test]
fn a_number_that_is_taken_is_said_after_some_tries() {
    // The server closes the line of a player that it does not take.
    let port = listen(|mut stream, _| {
        let _ = stream.read(&mut [0; 256]);
    });
    let (result, _) = play(&setup(port, 1.0), "Instep", &[2], &AtomicBool::new(false));
    let message = result.unwrap_err().to_string();
    assert!(message.contains("refused player 2 of Instep") && message.contains("taken"), "{message}");
}

#[test]
fn another_kind_of_server_is_named_as_such() {
    let port = listen(|mut stream, _| {
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
        std::thread::sleep(Duration::from_millis(500));
    });
    let (result, _) = play(&setup(port, 1.0), "Instep", &[2], &AtomicBool::new(false));
    assert!(matches!(result, Err(RcssError::Protocol { .. })), "{result:?}");
    // One whose messages have the right frame but are something else.
    let port = listen(|mut stream, _| {
        for _ in 0..200 {
            send(&mut stream, b"{\"hello\": [1, 2)}");
        }
        std::thread::sleep(Duration::from_millis(500));
    });
    let (result, _) = play(&setup(port, 1.0), "Instep", &[2], &AtomicBool::new(false));
    assert!(matches!(result, Err(RcssError::Protocol { .. })), "{result:?}");
}

#[test]
fn a_line_that_breaks_is_joined_again_and_every_message_is_answered() {
    let stop = Arc::new(AtomicBool::new(false));
    let raise = Arc::clone(&stop);
    // Perceptions with holes in them, and of a version that says other things; each is answered. Then the line breaks.
    let port = listen(move |mut stream, i| {
        let mut buffer = [0; 4096];
        assert!(stream.read(&mut buffer).unwrap() > 0, "it asks to join");
        for message in [
            &b"(time (now 0.02))(GS (t 0.0)(pm BeforeKickOff)(sl 0)(sr 0))"[..],
            b"(time (now nan))(version 9)(GS)",
            b"(time (now 0.04))(((((",
            b"",
        ] {
            send(&mut stream, message);
            let count = stream.read(&mut buffer).unwrap();
            assert!(buffer[..count].ends_with(b"(syn)"), "{:?}", String::from_utf8_lossy(&buffer[..count]));
        }
        if i == 2 {
            raise.store(true, Ordering::Relaxed);
            std::thread::sleep(Duration::from_secs(1));
        }
    });
    let (result, said) = play(&setup(port, 100.0), "Instep", &[2], &stop);
    let tally = &result.unwrap()[0];
    assert_eq!((tally.reconnects, tally.fell), (2, 0));
    assert!(tally.cycles >= 8 && tally.malformed >= 2, "{tally:?}");
    assert!(said.iter().any(|line| line.contains("tries again")), "{said:?}");
}
