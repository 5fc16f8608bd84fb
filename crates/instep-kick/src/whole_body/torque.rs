//! Feed-forward torques and the planned centre of pressure of a joint trajectory.
//!
//! Three successive poses of the plan give speed and acceleration by central differences; inverse dynamics (equation
//! (33) of paper 1) gives the wrench that the ground must put on the robot, whose zero-moment point is the planned
//! centre of pressure (Kajita, Introduction to humanoid robotics, section 3.2). With both feet on the ground the force
//! is shared by the lever rule; the joint torques then follow from J^T. The torques let weak, soft drives follow.

use instep_motion::phase::Side;
use instep_robot::control::torque_range;
use instep_robot::{Robot, RobotData};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use crate::whole_body::body::Body;
use instep_robot::tree::TreePose;

/// Scratch space for one trajectory.
#[derive(Debug)]
pub(crate) struct Dynamics {
    data: RobotData,
    /// Positions (7 + n) in the support sole's frame: before, now, after.
    q: [Vec<f64>; 3],
    v: Vec<f64>,
    v_before: Vec<f64>,
    v_after: Vec<f64>,
    a: Vec<f64>,
    generalised: Vec<f64>,
    /// Joint torques, N m.
    pub(crate) torques: Vec<f64>,
    /// Joint pairs that one motor turns.
    coupled: Vec<[usize; 2]>,
}

impl Dynamics {
    /// For `robot`, whose pairs of joints in `coupled` are turned by one motor each.
    pub(crate) fn new(robot: &Robot, coupled: &[[String; 2]]) -> Self {
        let (nq, nv) = (robot.nq(), robot.nv());
        Self {
            data: robot.data(),
            q: [vec![0.0; nq], vec![0.0; nq], vec![0.0; nq]],
            v: vec![0.0; nv],
            v_before: vec![0.0; nv],
            v_after: vec![0.0; nv],
            a: vec![0.0; nv],
            generalised: vec![0.0; nv],
            torques: vec![0.0; robot.joints.len()],
            coupled: coupled.iter().filter_map(|[a, b]| Some([robot.joint_index(a)?, robot.joint_index(b)?])).collect(),
        }
    }

    /// Fills all three poses with the same one.
    pub(crate) fn fill(&mut self, body: &Body, support: Side, angles: &[f64], pose: &TreePose) {
        for _ in 0..3 {
            self.push(body, support, angles, pose);
        }
    }

    /// The next pose of the trajectory; `pose` is that of `angles`.
    pub(crate) fn push(&mut self, body: &Body, support: Side, angles: &[f64], pose: &TreePose) {
        self.q.rotate_left(1);
        let sole = &body.robot.leg(support).sole;
        let turn = pose.rotation[sole.link].transpose();
        let position = turn * (-pose.point(sole));
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let q = &mut self.q[2];
        q[..3].copy_from_slice(position.as_slice());
        q[3..7].copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
        q[7..].copy_from_slice(angles);
    }

    /// The joint angles of the middle pose, rad.
    pub(crate) fn angles(&self) -> &[f64] {
        &self.q[1][7..]
    }

    /// The joint speeds in the middle pose, rad/s, after [`Dynamics::solve`].
    pub(crate) fn speeds(&self) -> &[f64] {
        &self.v[6..]
    }

    /// Torques in the middle pose of poses `dt` (s) apart; `pose` is the middle pose. `shared`: both feet stand.
    /// Returns the planned centre of pressure in the support sole's frame, m.
    pub(crate) fn solve(&mut self, body: &Body, swing: Side, pose: &TreePose, dt: f64, shared: bool) -> [f64; 2] {
        self.data.difference_into(&self.q[0], &self.q[1], dt, &mut self.v_before);
        self.data.difference_into(&self.q[1], &self.q[2], dt, &mut self.v_after);
        for i in 0..self.v.len() {
            self.v[i] = 0.5 * (self.v_before[i] + self.v_after[i]);
            self.a[i] = (self.v_after[i] - self.v_before[i]) / dt;
        }
        self.data.set_state(&self.q[1], &self.v);
        self.data.inverse_dynamics_into(&self.a, &[], &mut self.generalised);

        // The wrench in the support sole's frame about its origin.
        let tau = &self.generalised;
        let q = &self.q[1];
        let base = Vector3::new(q[0], q[1], q[2]);
        let turn = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(q[3], q[4], q[5], q[6]));
        let force = Vector3::new(tau[0], tau[1], tau[2]);
        let moment = turn * Vector3::new(tau[3], tau[4], tau[5]) + base.cross(&force);
        let weight = force.z.max(0.1);
        let zmp = [-moment.y / weight, moment.x / weight];

        // Shares of the two feet, and what is left as a moment.
        let home = body.stand(swing).home;
        let share = if shared { (1.0 - zmp[1] / home.y).clamp(0.0, 1.0) } else { 1.0 };
        let swing_point = Vector3::new(home.x, home.y, 0.0);
        let rest = moment - swing_point.cross(&(force * (1.0 - share)));
        self.torques.copy_from_slice(&self.generalised[6..]);
        let into_base = turn.inverse();
        for (side, force, moment) in
            [(swing.other(), force * share, rest * share), (swing, force * (1.0 - share), rest * (1.0 - share))]
        {
            // Both in the base frame, about the sole's centre.
            let link = body.robot.leg(side).sole.link;
            let at = pose.point(&body.robot.leg(side).sole);
            let (force, moment) = (into_base * force, into_base * moment);
            for joint in body.robot.leg(side).joints() {
                if body.tree.moves(joint, link) {
                    let axis = pose.axis[joint];
                    self.torques[joint] -= axis.dot(&(moment + (at - pose.anchor[joint]).cross(&force)));
                }
            }
        }
        for [a, b] in &self.coupled {
            let mean = 0.5 * (self.torques[*a] + self.torques[*b]);
            (self.torques[*a], self.torques[*b]) = (mean, mean);
        }
        for (torque, joint) in self.torques.iter_mut().zip(&body.robot.joints) {
            *torque = if torque.is_finite() { torque.clamp(-1.5 * joint.torque, 1.5 * joint.torque) } else { 0.0 };
        }
        zmp
    }

    /// The largest shares of a joint's speed limit and of a motor's torque at its speed, each with its joint.
    pub(crate) fn shares(&self, robot: &Robot) -> [(f64, usize); 2] {
        let mut speed = (0.0, 0);
        let mut torque = (0.0, 0);
        for (j, joint) in robot.joints.iter().enumerate() {
            let (v, t) = (self.v[6 + j], self.torques[j]);
            if v.abs() / joint.speed > speed.0 {
                speed = (v.abs() / joint.speed, j);
            }
            let [least, greatest] = torque_range(joint, v);
            let most = if t > 0.0 { greatest } else { -least };
            let share = t.abs() / most.max(0.05 * joint.torque);
            if share > torque.0 {
                torque = (share, j);
            }
        }
        [speed, torque]
    }

    /// Effective mass (kg) at `point` of `link` in the middle pose along `direction`, both in the support frame.
    pub(crate) fn effective_mass(&mut self, link: usize, point: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        self.data.set_state(&self.q[1], &self.v);
        let local = self.data.link_matrix(link).transpose() * (point - self.data.link_position(link));
        self.data.effective_mass(&instep_robot::LinkPoint { link, point: local }, direction)
    }
}
