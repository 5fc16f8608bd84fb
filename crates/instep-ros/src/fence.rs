//! Keeps the node's sockets to the loopback device.
//!
//! The DDS library sends only where it is told, but its sockets listen on every interface: a packet from the network
//! would still be read. Linux can bind a socket to a device after the fact (socket(7), SO_BINDTODEVICE; without
//! privileges since 5.7), so that such a packet never reaches the program.

use std::io;

/// Ports of one domain (RTPS 2.5, section 9.6.2.3): 7400 + 250 x domain and the next 249.
fn ports(domain: u16) -> std::ops::Range<u32> {
    let first = 7400 + 250 * u32::from(domain);
    first..first + 250
}

/// Binds every UDP socket of this program that listens on one of the domain's ports to the loopback device; gives how
/// many there are.
///
/// # Errors
/// When the system does not allow it.
#[cfg(target_os = "linux")]
pub(crate) fn raise(domain: u16) -> io::Result<usize> {
    let mut fenced = 0;
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let name = entry?.file_name();
        let Some(fd) = name.to_str().and_then(|name| name.parse::<libc::c_int>().ok()) else { continue };
        if !udp_port(fd).is_some_and(|port| ports(domain).contains(&u32::from(port))) {
            continue;
        }
        // SAFETY: the option's value is a string of the length that is told; a descriptor that was closed meanwhile
        // gives an error.
        let done = unsafe { libc::setsockopt(fd, libc::SOL_SOCKET, libc::SO_BINDTODEVICE, c"lo".as_ptr().cast(), 2) };
        if done != 0 {
            return Err(io::Error::last_os_error());
        }
        fenced += 1;
    }
    Ok(fenced)
}

/// The local port of an IPv4 UDP socket.
#[cfg(target_os = "linux")]
fn udp_port(fd: libc::c_int) -> Option<u16> {
    let (mut kind, mut length) = (0_i32, size_of::<i32>() as libc::socklen_t);
    // SAFETY: both calls write at most `length` bytes into what they are given; a descriptor that is no socket gives
    // an error.
    unsafe {
        let kind_at = (&raw mut kind).cast();
        if libc::getsockopt(fd, libc::SOL_SOCKET, libc::SO_TYPE, kind_at, &raw mut length) != 0
            || kind != libc::SOCK_DGRAM
        {
            return None;
        }
        let mut address: libc::sockaddr_in = std::mem::zeroed();
        length = size_of::<libc::sockaddr_in>() as libc::socklen_t;
        let got = libc::getsockname(fd, (&raw mut address).cast(), &raw mut length);
        let ipv4 = i32::from(address.sin_family) == libc::AF_INET;
        (got == 0 && ipv4).then(|| u16::from_be(address.sin_port))
    }
}

/// Elsewhere there is no such option.
#[cfg(not(target_os = "linux"))]
pub(crate) fn raise(domain: u16) -> io::Result<usize> {
    let _ = ports(domain);
    Err(io::Error::new(io::ErrorKind::Unsupported, "only Linux can bind a socket to a device"))
}
