//! A team message in the ten bytes that the server lets pass.
//!
//! Eighty bits, most significant first: team 5, number 7, able 1, role 2, x 10, y 9, heading 6, time to the ball 6, ball known 1,
//! its x 10, its y 9, its speed along x 5 and y 5, its age 4. Both teams hear everything: the team's five bits are from its name,
//! so that of 32 foreign messages one passes, and then mostly with a number or a role that tells on it.

use instep_behaviour::{Mate, Role};
use instep_field::{Field, Pose};
use instep_player::{HeardBall, Message};

/// Longest message that the server passes on, bytes.
pub const LENGTH: usize = 10;
/// Fastest ball that can be told, m/s.
const FASTEST: f64 = 6.0;
/// A step of the time to the ball and of the ball's age, s.
const STEPS: [f64; 2] = [0.5, 0.2];

/// What a team's messages are written with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Code {
    team: u64,
    /// Half of the field with its border, m.
    half: [f64; 2],
}

struct Bits(u128, u32);

impl Bits {
    fn put(&mut self, value: u64, count: u32) {
        self.0 = (self.0 << count) | u128::from(value & ((1 << count) - 1));
    }

    /// A number between -most and most, in an odd number of levels: zero is one of them.
    fn number(&mut self, value: f64, most: f64, count: u32) {
        let levels = ((1_u64 << count) - 2) as f64;
        self.put((((value / most).clamp(-1.0, 1.0) * 0.5 + 0.5) * levels).round() as u64, count);
    }

    fn steps(&mut self, value: f64, step: f64, count: u32) {
        let most = ((1_u64 << count) - 1) as f64;
        self.put((value / step).clamp(0.0, most).round() as u64, count);
    }

    fn take(&mut self, count: u32) -> u64 {
        self.1 -= count;
        ((self.0 >> self.1) as u64) & ((1 << count) - 1)
    }

    fn take_number(&mut self, most: f64, count: u32) -> f64 {
        (self.take(count) as f64 / ((1_u64 << count) - 2) as f64 * 2.0 - 1.0) * most
    }
}

const ROLES: [Role; 4] = [Role::Keeper, Role::Striker, Role::Defender, Role::Supporter];

impl Code {
    /// For `team` on `field`.
    #[must_use]
    pub fn new(team: &str, field: &Field) -> Self {
        let hash = team.bytes().fold(7_u64, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
        Self {
            team: (hash ^ (hash >> 5) ^ (hash >> 10)) & 31,
            half: [0.5 * field.length + field.border, 0.5 * field.width + field.border],
        }
    }

    /// Writes a message.
    #[must_use]
    pub fn write(&self, message: &Message) -> [u8; LENGTH] {
        let mate = &message.mate;
        let mut bits = Bits(0, 80);
        bits.put(self.team, 5);
        bits.put(u64::from(mate.number), 7);
        bits.put(u64::from(mate.able && !mate.penalised), 1);
        bits.put(ROLES.iter().position(|role| *role == mate.role).unwrap_or(3) as u64, 2);
        bits.number(mate.pose.x, self.half[0], 10);
        bits.number(mate.pose.y, self.half[1], 9);
        bits.number(mate.pose.heading, std::f64::consts::PI, 6);
        bits.steps(mate.time_to_ball, STEPS[0], 6);
        let ball = message.ball;
        bits.put(u64::from(ball.is_some()), 1);
        let ball = ball.unwrap_or(HeardBall { position: [0.0; 2], velocity: [0.0; 2], age: 0.0 });
        bits.number(ball.position[0], self.half[0], 10);
        bits.number(ball.position[1], self.half[1], 9);
        bits.number(ball.velocity[0], FASTEST, 5);
        bits.number(ball.velocity[1], FASTEST, 5);
        bits.steps(ball.age, STEPS[1], 4);
        let bytes = bits.0.to_be_bytes();
        std::array::from_fn(|i| bytes[16 - LENGTH + i])
    }

    /// Reads what was heard; `None` for what no mate said.
    #[must_use]
    pub fn read(&self, bytes: &[u8]) -> Option<Message> {
        let bytes: [u8; LENGTH] = bytes.try_into().ok()?;
        let value = bytes.iter().fold(0_u128, |value, byte| (value << 8) | u128::from(*byte));
        let mut bits = Bits(value, 80);
        if bits.take(5) != self.team {
            return None;
        }
        let number = u8::try_from(bits.take(7)).ok().filter(|number| (1..=99).contains(number))?;
        let able = bits.take(1) == 1;
        let role = ROLES[bits.take(2) as usize];
        let (x, y) = (bits.take_number(self.half[0], 10), bits.take_number(self.half[1], 9));
        let heading = bits.take_number(std::f64::consts::PI, 6);
        let time_to_ball = bits.take(6) as f64 * STEPS[0];
        let known = bits.take(1) == 1;
        let position = [bits.take_number(self.half[0], 10), bits.take_number(self.half[1], 9)];
        let velocity = [bits.take_number(FASTEST, 5), bits.take_number(FASTEST, 5)];
        let age = bits.take(4) as f64 * STEPS[1];
        let mate = Mate { number, pose: Pose::new(x, y, heading), role, time_to_ball, able, penalised: false };
        Some(Message { mate, ball: known.then_some(HeardBall { position, velocity, age }) })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_is_said_is_heard_to_a_few_centimetres(
            x in -29.0..29.0_f64, y in -20.0..20.0_f64, heading in -3.1..3.1_f64, far in 0.0..31.0_f64,
            ball in prop::option::of((-27.0..27.0_f64, -18.0..18.0_f64, -5.0..5.0_f64, 0.0..2.8_f64)),
            number in 1_u8..=99, able: bool, role in 0_usize..4,
        ) {
            let code = Code::new("Instep", &Field::named("simulation").unwrap());
            let mate = Mate { number, pose: Pose::new(x, y, heading), role: ROLES[role], time_to_ball: far, able, penalised: false };
            let ball = ball.map(|(x, y, vx, age)| HeardBall { position: [x, y], velocity: [vx, 0.0], age });
            let heard = code.read(&code.write(&Message { mate, ball })).unwrap();
            prop_assert_eq!((heard.mate.number, heard.mate.able, heard.mate.role), (number, able, ROLES[role]));
            prop_assert!(heard.mate.pose.distance(&mate.pose) < 0.06);
            prop_assert!(instep_field::wrap(heard.mate.pose.heading - heading).abs() < 0.06);
            prop_assert!((heard.mate.time_to_ball - far).abs() <= 0.26);
            prop_assert_eq!(heard.ball.is_some(), ball.is_some());
            if let (Some(a), Some(b)) = (heard.ball, ball) {
                prop_assert!((a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1]) < 0.06);
                prop_assert!((a.velocity[0] - b.velocity[0]).abs() < 0.21 && (a.age - b.age).abs() <= 0.11);
            }
        }

        #[test]
        fn whatever_was_heard_is_a_message_of_numbers_or_none(bytes in prop::collection::vec(any::<u8>(), 0..14)) {
            let code = Code::new("Instep", &Field::named("simulation").unwrap());
            if let Some(message) = code.read(&bytes) {
                prop_assert!(message.is_finite());
            }
        }
    }

    #[test]
    fn another_teams_messages_are_not_ours() {
        let field = Field::named("simulation").unwrap();
        let [a, b] = ["Instep", "Other"].map(|team| Code::new(team, &field));
        let mate = Mate {
            number: 3,
            pose: Pose::default(),
            role: Role::Striker,
            time_to_ball: 1.0,
            able: true,
            penalised: false,
        };
        assert!(b.read(&a.write(&Message { mate, ball: None })).is_none());
    }
}
