//! The balls that robots play, and what slows them: air, rolling and bouncing.
//!
//! Drag is 1/2 rho c A v^2 against the ball's velocity, with one coefficient c: a football's is about 0.43 up to a Reynolds
//! number of 2.2e5 to 3.0e5, that is 15 m/s, and falls to 0.15 beyond (Asai, Seo, Kobayashi and Sakashita, Fundamental
//! aerodynamics of the soccer ball, Sports Engineering 10, 2007); faster balls are therefore slowed too much here. A smooth
//! sphere's is 0.4 to 0.5 between 1e3 and 2e5, which are the small balls' numbers. Spin gives no lift.

use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};

use crate::settings::ImpactLaw;

/// Density of air at 20 degrees, kg/m^3.
const AIR: f64 = 1.204;

/// The ball: a hollow sphere. In TOML a name of [`NAMED`], or a table whose missing fields are the size-5 ball's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ball {
    /// Mass, kg.
    pub mass: f64,
    /// Radius, m.
    pub radius: f64,
    /// Drag coefficient.
    pub drag: f64,
    /// Deceleration on the pitch while it rolls, m/s^2.
    pub rolling_deceleration: f64,
    /// Rebound from the pitch: contact time, s, and restitution.
    pub rebound: ImpactLaw,
}

/// The balls with a name. Rolling: 0.3 (one team's plan) and 0.57 m/s^2 (another's measurement) on robot soccer turf
/// (facts/physics-of-the-kick.md), of which 0.4 lies between; FIFA's test on turf of full length, 4 to 10 m after a ramp
/// of 1 m, is 0.6 to 1.5. Rebound: FIFA's test on turf asks a size-5 ball for 0.6 to 1.0 m after a fall of 2 m, restitution
/// 0.55 to 0.71; on a hard floor for 1.25 to 1.55 m, 0.79 to 0.88. For the smaller balls the same are assumed.
pub const NAMED: [(&str, Ball); 3] = [
    ("size-5", Ball { mass: 0.43, radius: 0.11, ..TURF }),
    ("size-1", Ball { mass: 0.2, radius: 0.07, ..TURF }),
    ("spl-foam", Ball { mass: 0.044, radius: 0.05, ..TURF }),
];

const TURF: Ball = Ball {
    mass: 0.43,
    radius: 0.11,
    drag: 0.43,
    rolling_deceleration: 0.4,
    rebound: ImpactLaw { contact_time: 0.016, restitution: 0.63, friction: 0.6 },
};

impl Default for Ball {
    fn default() -> Self {
        TURF
    }
}

impl Ball {
    /// Force of the air (N) on the ball at `velocity` (m/s) over the speed, kg/s: to be multiplied with the reversed velocity.
    pub(crate) fn air_damping(&self, speed: f64) -> f64 {
        0.5 * AIR * self.drag * std::f64::consts::PI * self.radius * self.radius * speed
    }
}

/// The table form.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Table {
    mass: f64,
    radius: f64,
    drag: f64,
    rolling_deceleration: f64,
    rebound: ImpactLaw,
}

impl Default for Table {
    fn default() -> Self {
        let Ball { mass, radius, drag, rolling_deceleration, rebound } = Ball::default();
        Self { mass, radius, drag, rolling_deceleration, rebound }
    }
}

impl<'de> Deserialize<'de> for Ball {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Form;
        impl<'de> Visitor<'de> for Form {
            type Value = Ball;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a ball, or a table with mass, radius, drag, rolling_deceleration and rebound")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Ball, E> {
                let found = NAMED.iter().find(|(known, _)| *known == name);
                found.map(|(_, ball)| *ball).ok_or_else(|| {
                    let known = NAMED.map(|(known, _)| known).join(", ");
                    E::custom(format!("there is no ball \"{name}\"; expected one of {known}, or a table"))
                })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Ball, A::Error> {
                let Table { mass, radius, drag, rolling_deceleration, rebound } =
                    Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Ball { mass, radius, drag, rolling_deceleration, rebound })
            }
        }
        deserializer.deserialize_any(Form)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_a_name_or_a_table_and_else_an_error_that_says_so() {
        let read = |text: &str| serde_json::from_str::<Ball>(text);
        assert_eq!(read("\"spl-foam\"").unwrap(), NAMED[2].1);
        assert_eq!(read("{\"mass\": 0.3}").unwrap(), Ball { mass: 0.3, ..Ball::default() });
        let error = read("\"size-9\"").unwrap_err().to_string();
        assert!(error.contains("size-9") && error.contains("size-5, size-1, spl-foam"), "{error}");
        assert!(read("{\"weight\": 0.3}").unwrap_err().to_string().contains("weight"));
        assert!(read("3").is_err());
    }

    /// A size-5 ball at 12 m/s: 1/2 x 1.204 x 0.43 x 0.0380 m^2 x 144 m^2/s^2 = 1.417 N.
    #[test]
    fn the_airs_force_is_that_of_the_formula() {
        assert!((Ball::default().air_damping(12.0) * 12.0 - 1.417).abs() < 1e-3);
    }
}
