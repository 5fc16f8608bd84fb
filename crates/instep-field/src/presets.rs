//! The fields that robots play on, with their sources.
//!
//! HL: rules of the RoboCup Humanoid League (kid size 2025; adult size, unchanged from 2024 to 2025). HSL: rules of the
//! RoboCup Humanoid Soccer League 2026, drafts; where they leave a range, its lower goal width and the ball named
//! there. Simulation: what the server `rcsssmj` 0.2.1 builds for `fifa7vs7` and `fifa`.

use crate::field::{Area, Ball, Field, GoalSize, Landmark, LandmarkClass};

/// Names of the fields that [`Field::named`] knows.
pub const FIELD_NAMES: &[&str] = &["adult-2024", "kid", "hsl-s", "hsl-m", "hsl-l", "simulation", "fifa"];

/// FIFA size 1, 4 and 5: the middle of what FIFA's tests and makers give.
const SIZE_1: Ball = Ball { radius: 0.07, mass: 0.20 };
const SIZE_4: Ball = Ball { radius: 0.103, mass: 0.37 };
const SIZE_5: Ball = Ball { radius: 0.11, mass: 0.43 };
/// The simulation server's.
const SIMULATED: Ball = Ball { radius: 0.11, mass: 0.41 };

pub(crate) fn field(name: &str) -> Option<Field> {
    let area = |length, width| Area { length, width };
    let robots = |size: [f64; 2], goal: [f64; 3], goal_area, penalty_area, penalty_mark, circle_radius, ball| Field {
        name: name.to_owned(),
        length: size[0],
        width: size[1],
        line_width: 0.05,
        border: 1.0,
        goal: GoalSize { width: goal[0], height: goal[1], depth: goal[2] },
        goal_area,
        penalty_area: Some(penalty_area),
        penalty_mark,
        circle_radius,
        ball,
        own_landmarks: None,
    };
    Some(match name {
        "adult-2024" => robots([14.0, 9.0], [2.6, 1.8, 0.6], area(1.0, 4.0), area(3.0, 6.0), 2.1, 1.5, SIZE_5),
        "kid" => robots([9.0, 6.0], [2.6, 1.2, 0.6], area(1.0, 3.0), area(2.0, 5.0), 1.5, 0.75, SIZE_1),
        "hsl-s" => robots([9.0, 6.0], [1.8, 1.2, 0.5], area(1.0, 3.0), area(2.0, 4.0), 1.5, 0.75, SIZE_1),
        "hsl-m" => robots([14.0, 9.0], [2.4, 1.5, 0.7], area(1.0, 4.0), area(3.0, 6.0), 2.0, 1.5, SIZE_4),
        "hsl-l" => Field {
            line_width: 0.12,
            ..robots([22.0, 14.0], [2.6, 1.8, 1.0], area(1.0, 5.0), area(3.5, 7.0), 2.5, 2.0, SIZE_5)
        },
        "simulation" => simulation(Field {
            line_width: 0.1,
            border: 3.0,
            ..robots([55.0, 36.0], [3.66, 1.83, 1.0], area(4.0, 7.3), area(9.0, 16.5), 7.32, 5.5, SIMULATED)
        }),
        "fifa" => Field {
            line_width: 0.1,
            border: 3.0,
            ..robots([105.0, 68.0], [7.32, 2.44, 1.6], area(5.5, 18.32), area(16.5, 40.32), 11.0, 9.15, SIZE_5)
        },
        _ => return None,
    })
}

/// The landmarks that the server reports in the place of those of the lines that it draws: those of both areas at the areas'
/// whole width from the middle, where half of it is meant, and none at the centre mark.
fn simulation(field: Field) -> Field {
    let mut landmarks = field.landmarks();
    let widths = [Some(field.goal_area), field.penalty_area].into_iter().flatten().map(|area| area.width);
    for landmark in &mut landmarks {
        let junction = matches!(landmark.class, LandmarkClass::L | LandmarkClass::T);
        if let Some(width) = widths.clone().find(|width| junction && landmark.y.abs() == width / 2.0) {
            landmark.y = width.copysign(landmark.y);
        }
    }
    landmarks.retain(|l: &Landmark| (l.x, l.y) != (0.0, 0.0));
    Field { own_landmarks: Some(landmarks), ..field }
}
