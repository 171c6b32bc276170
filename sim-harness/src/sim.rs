//! The simulator: one scene with the robot in it, stepped in simulated time.
//!
//! A policy step is [`Sim::apply`], which latches the goal, followed by
//! [`SUBSTEPS`] calls of [`Sim::step_physics`]. All that is read is
//! consistent with the newest joint positions: the position and velocity stages of the next step
//! have already run.

mod show;

use std::sync::Arc;

use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase, MjtState, MjtWarning};
use mujoco_rs::wrappers::mj_auxiliary::MjVfs;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::action::{Action, PHYSICS_STEP_S, SUBSTEPS};
use crate::error::SimError;
use crate::osc::{ArmDynamics, Gains, JointVector, Osc};
use crate::panda::{self, ARM_JOINTS, FINGER_BODIES, HOME_RAD};
use crate::pose::Pose;
use crate::scene::{PlacedObject, Scene};

/// The MuJoCo version that the harness was built and tested with.
pub const MUJOCO_VERSION: &str = "3.17.0";

/// What the robot measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotState {
    /// Simulated time, s.
    pub time_s: f64,
    /// Joint positions, rad.
    pub joint_position_rad: [f64; ARM_JOINTS],
    /// Joint velocities, rad/s.
    pub joint_velocity_rad_s: [f64; ARM_JOINTS],
    /// Pose of the tool centre point, base frame.
    pub tcp: Pose,
    /// Linear velocity of the tool centre point, base frame, m/s.
    pub tcp_velocity_m_s: [f64; 3],
    /// Angular velocity of the tool, base frame, rad/s.
    pub tcp_angular_velocity_rad_s: [f64; 3],
    /// Distance between the finger pads, m: 0 to 0.08.
    pub gripper_width_m: f64,
}

/// Where an object truly is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectState {
    /// Identity within the scene.
    pub id: u16,
    /// Centre of its bounding box, base frame.
    pub pose: Pose,
    /// Linear velocity of that centre, base frame, m/s.
    pub velocity_m_s: [f64; 3],
}

/// A copy of everything that determines the future of a [`Sim`].
///
/// It holds MuJoCo's whole data, not only its state vector: which objects sleep is not part of the
/// latter.
#[derive(Clone, Debug)]
pub struct Snapshot {
    data: MjData<Arc<MjModel>>,
    scene: Arc<Scene>,
    osc: Osc,
}

impl PartialEq for Snapshot {
    fn eq(&self, other: &Self) -> bool {
        let future = |s: &Self| (s.data.state(STATE), s.data.tree_asleep().to_vec());
        self.osc == other.osc && self.scene == other.scene && future(self) == future(other)
    }
}

/// Indices into the compiled model.
#[derive(Clone, Debug)]
struct ObjectIndex {
    body: usize,
    /// Addresses of the free joint's position and velocity; furniture has none.
    joint: Option<(usize, usize)>,
}

/// One scene with the robot in it.
#[derive(Debug)]
pub struct Sim {
    data: MjData<Arc<MjModel>>,
    scene: Arc<Scene>,
    objects: Vec<ObjectIndex>,
    /// For each geom: the id of the object that it belongs to, or what else it is.
    owners: Vec<Owner>,
    tcp_site: usize,
    initial: Box<[f64]>,
    osc: Osc,
}

/// What a geom belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// An object of the scene, by id.
    Object(u16),
    /// A finger of the gripper.
    Finger,
    /// The rest of the arm.
    Arm,
    /// The table, the floor.
    World,
}

const STATE: u32 = MjtState::mjSTATE_INTEGRATION as u32;

impl Sim {
    /// Compiles a scene and puts the robot into its rest posture.
    ///
    /// # Errors
    /// [`SimError::Version`] if another MuJoCo is loaded, [`SimError::Compile`] if MuJoCo refuses
    /// the scene.
    pub fn new(scene: Scene) -> Result<Self, SimError> {
        let model = compile(&scene)?;
        let mut data = MjData::new(Arc::new(model));
        let tcp_site = required(&data, MjtObjBase::mjOBJ_SITE, panda::TCP_SITE)?;
        let objects = scene
            .objects()
            .iter()
            .map(|object| index_object(&data, object))
            .collect::<Result<Vec<_>, _>>()?;
        let owners = owners(&data, &objects)?;
        data.qpos_mut()[..ARM_JOINTS].copy_from_slice(&HOME_RAD);
        let half_open = 0.5 * panda::GRIPPER_OPEN_M;
        data.qpos_mut()[ARM_JOINTS..ARM_JOINTS + 2].fill(half_open);
        data.step1();
        let initial = data.state(STATE);
        let (tcp_m, rotation) = tcp_of(&data, tcp_site);
        let osc = Osc::new(Gains::default(), tcp_m, rotation);
        let scene = Arc::new(scene);
        Ok(Self {
            data,
            scene,
            objects,
            owners,
            tcp_site,
            initial,
            osc,
        })
    }

    /// Back to the moment after [`Sim::new`].
    pub fn reset(&mut self) {
        let initial = std::mem::take(&mut self.initial);
        self.load(&initial);
        self.initial = initial;
        let (tcp_m, rotation) = tcp_of(&self.data, self.tcp_site);
        self.osc = Osc::new(Gains::default(), tcp_m, rotation);
    }

    /// The scene as it was put together. Poses in it are those of the start.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Simulated time, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.data.time()
    }

    /// Takes the action of a policy step: the goal becomes the measured pose plus the increment.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if MuJoCo found a state that is not finite since the last call.
    pub fn apply(&mut self, action: &Action) -> Result<(), SimError> {
        self.check()?;
        let (tcp_m, rotation) = tcp_of(&self.data, self.tcp_site);
        self.osc.latch(tcp_m, rotation, action);
        Ok(())
    }

    /// Advances by one physics step of 2 ms.
    pub fn step_physics(&mut self) {
        let torque = self.osc.torque_nm(&self.dynamics());
        let setpoint = self.osc.slew_gripper_m();
        // The motors' limits are the actuators' control ranges: MuJoCo clamps.
        let ctrl = self.data.ctrl_mut();
        ctrl[..ARM_JOINTS].copy_from_slice(torque.as_slice());
        ctrl[ARM_JOINTS] = setpoint;
        self.data.step2();
        self.data.step1();
    }

    /// A whole policy step: [`Sim::apply`] and the physics steps that follow it.
    ///
    /// # Errors
    /// As for [`Sim::apply`].
    pub fn step_policy(&mut self, action: &Action) -> Result<(), SimError> {
        self.apply(action)?;
        for _ in 0..SUBSTEPS {
            self.step_physics();
        }
        Ok(())
    }

    /// What the robot measures now.
    #[must_use]
    pub fn robot(&self) -> RobotState {
        let arm = self.dynamics();
        let velocity = arm.jacobian * arm.velocity_rad_s;
        let q = UnitQuaternion::from_rotation_matrix(&arm.tcp_rotation);
        let fingers = &self.data.qpos()[ARM_JOINTS..ARM_JOINTS + 2];
        RobotState {
            time_s: self.data.time(),
            joint_position_rad: arm.position_rad.into(),
            joint_velocity_rad_s: arm.velocity_rad_s.into(),
            tcp: Pose {
                position_m: arm.tcp_m.into(),
                orientation: [q.w, q.i, q.j, q.k],
            },
            tcp_velocity_m_s: [velocity[0], velocity[1], velocity[2]],
            tcp_angular_velocity_rad_s: [velocity[3], velocity[4], velocity[5]],
            gripper_width_m: fingers[0] + fingers[1],
        }
    }

    /// Where all objects truly are, by ascending id.
    #[must_use]
    pub fn objects(&self) -> Vec<ObjectState> {
        self.scene
            .objects()
            .iter()
            .zip(&self.objects)
            .map(|(o, i)| self.read(o.id, i))
            .collect()
    }

    /// Where one object truly is.
    #[must_use]
    pub fn object(&self, id: u16) -> Option<ObjectState> {
        let index = self.objects.get(usize::from(id).checked_sub(1)?)?;
        Some(self.read(id, index))
    }

    /// Puts an object somewhere else, at rest: for tests of faults. Furniture stays where it is.
    pub fn teleport(&mut self, id: u16, pose: Pose) {
        let index = usize::from(id)
            .checked_sub(1)
            .and_then(|i| self.objects.get(i));
        let Some((qpos, dof)) = index.and_then(|i| i.joint) else {
            return;
        };
        self.data.qpos_mut()[qpos..qpos + 3].copy_from_slice(&pose.position_m);
        self.data.qpos_mut()[qpos + 3..qpos + 7].copy_from_slice(&pose.orientation);
        self.data.qvel_mut()[dof..dof + 6].fill(0.0);
        let state = self.data.state(STATE);
        self.load(&state);
    }

    /// Whether two things touch.
    #[must_use]
    pub fn touches(&self, a: Owner, b: Owner) -> bool {
        self.data.contact().iter().any(|contact| {
            let [x, y] = contact
                .geom
                .map(|g| usize::try_from(g).ok().and_then(|g| self.owners.get(g)));
            let pair = (x.copied(), y.copied());
            pair == (Some(a), Some(b)) || pair == (Some(b), Some(a))
        })
    }

    /// The object that the fingers touch, with the lowest id if there are several.
    #[must_use]
    pub fn held(&self) -> Option<u16> {
        self.scene
            .objects()
            .iter()
            .map(|o| o.id)
            .find(|&id| self.touches(Owner::Object(id), Owner::Finger))
    }

    /// Everything that determines the future.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            data: self.data.clone(),
            scene: self.scene.clone(),
            osc: self.osc.clone(),
        }
    }

    /// Continues from a snapshot of a simulator with the same scene, bit for bit.
    ///
    /// # Errors
    /// [`SimError::Invalid`] if the snapshot is of another scene.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimError> {
        if snapshot.scene != self.scene {
            return Err(SimError::invalid(
                "snapshot",
                "it was taken of another scene",
            ));
        }
        self.data = snapshot.data.clone();
        self.osc = snapshot.osc.clone();
        Ok(())
    }

    /// Shared access for ray casting, and who owns which geom.
    pub(crate) fn rays(&mut self) -> (&mut MjData<Arc<MjModel>>, &[Owner]) {
        (&mut self.data, &self.owners)
    }

    /// Goes on from a state with everything awake.
    fn load(&mut self, state: &[f64]) {
        self.data.reset();
        let loaded = self.data.set_state(state, STATE);
        debug_assert!(loaded.is_ok(), "the state is of this model: {loaded:?}");
        self.data.step1();
    }

    fn read(&self, id: u16, index: &ObjectIndex) -> ObjectState {
        let velocity_m_s = index.joint.map_or([0.0; 3], |(_, dof)| {
            let v = &self.data.qvel()[dof..dof + 3];
            [v[0], v[1], v[2]]
        });
        ObjectState {
            id,
            pose: Pose {
                position_m: self.data.xpos()[index.body],
                orientation: self.data.xquat()[index.body],
            },
            velocity_m_s,
        }
    }

    fn dynamics(&self) -> ArmDynamics {
        let data = &self.data;
        let (tcp_m, tcp_rotation) = tcp_of(data, self.tcp_site);
        let mut arm = ArmDynamics {
            position_rad: JointVector::from_column_slice(&data.qpos()[..ARM_JOINTS]),
            velocity_rad_s: JointVector::from_column_slice(&data.qvel()[..ARM_JOINTS]),
            tcp_m,
            tcp_rotation,
            jacobian: nalgebra::zero(),
            inertia: nalgebra::zero(),
            bias_nm: JointVector::from_column_slice(&data.qfrc_bias()[..ARM_JOINTS]),
        };
        let (row_len, row_start) = (data.model().m_rownnz(), data.model().m_rowadr());
        let columns = data.model().m_colind();
        for joint in 0..ARM_JOINTS {
            let axis = Vector3::from(data.xaxis()[joint]);
            let lever = tcp_m - Vector3::from(data.xanchor()[joint]);
            arm.jacobian
                .fixed_view_mut::<3, 1>(0, joint)
                .copy_from(&axis.cross(&lever));
            arm.jacobian
                .fixed_view_mut::<3, 1>(3, joint)
                .copy_from(&axis);
            // MuJoCo keeps the lower triangle of the inertia as compressed rows.
            let row = row_start[joint] as usize..(row_start[joint] + row_len[joint]) as usize;
            for (column, value) in columns[row.clone()].iter().zip(&data.m()[row]) {
                let column = *column as usize;
                arm.inertia[(joint, column)] = *value;
                arm.inertia[(column, joint)] = *value;
            }
        }
        arm
    }

    fn check(&self) -> Result<(), SimError> {
        let bad = [
            (MjtWarning::mjWARN_BADQPOS, "a position is not finite"),
            (MjtWarning::mjWARN_BADQVEL, "a velocity is not finite"),
            (MjtWarning::mjWARN_BADQACC, "an acceleration is not finite"),
        ];
        for (warning, what) in bad {
            if self.data.warning()[warning as usize].number > 0 {
                return Err(SimError::Diverged {
                    time_s: self.time_s(),
                    what: what.to_owned(),
                });
            }
        }
        Ok(())
    }
}

fn compile(scene: &Scene) -> Result<MjModel, SimError> {
    let found = mujoco_rs::mujoco_version();
    if found != MUJOCO_VERSION {
        let needed = MUJOCO_VERSION.to_owned();
        return Err(SimError::Version {
            found: found.to_owned(),
            needed,
        });
    }
    let refused = |e: &dyn std::fmt::Display| SimError::Compile(e.to_string());
    let mut vfs = MjVfs::new();
    vfs.add_from_buffer("panda.xml", panda::MJCF.as_bytes())
        .map_err(|e| refused(&e))?;
    vfs.add_from_buffer("scene.xml", scene.to_mjcf().as_bytes())
        .map_err(|e| refused(&e))?;
    MjModel::from_xml_vfs("scene.xml", &vfs).map_err(|e| refused(&e))
}

fn required(data: &MjData<Arc<MjModel>>, of: MjtObjBase, name: &str) -> Result<usize, SimError> {
    data.model()
        .name_to_id(of, name)
        .ok_or_else(|| SimError::Compile(format!("the compiled scene has no `{name}`")))
}

fn index_object(data: &MjData<Arc<MjModel>>, o: &PlacedObject) -> Result<ObjectIndex, SimError> {
    let body = required(data, MjtObjBase::mjOBJ_BODY, &o.name)?;
    let model = data.model();
    let joint = usize::try_from(model.body_jntadr()[body])
        .ok()
        .map(|joint| {
            (
                model.jnt_qposadr()[joint] as usize,
                model.jnt_dofadr()[joint] as usize,
            )
        });
    Ok(ObjectIndex { body, joint })
}

fn owners(data: &MjData<Arc<MjModel>>, objects: &[ObjectIndex]) -> Result<Vec<Owner>, SimError> {
    let fingers = FINGER_BODIES
        .iter()
        .map(|name| required(data, MjtObjBase::mjOBJ_BODY, name))
        .collect::<Result<Vec<_>, _>>()?;
    let owner = |&body: &i32| {
        let body = body as usize;
        match objects.iter().position(|o| o.body == body) {
            Some(i) => Owner::Object((i + 1) as u16),
            None if fingers.contains(&body) => Owner::Finger,
            None if body == 0 => Owner::World,
            None => Owner::Arm,
        }
    };
    Ok(data.model().geom_bodyid().iter().map(owner).collect())
}

fn tcp_of(data: &MjData<Arc<MjModel>>, site: usize) -> (Vector3<f64>, Rotation3<f64>) {
    let rotation = Matrix3::from_row_slice(&data.site_xmat()[site]);
    (
        Vector3::from(data.site_xpos()[site]),
        Rotation3::from_matrix_unchecked(rotation),
    )
}

const _: () = assert!(SUBSTEPS as f64 * PHYSICS_STEP_S == crate::action::POLICY_STEP_S);
