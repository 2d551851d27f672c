//! A step of the magnet: exact where a closed form applies, otherwise by Runge-Kutta.

use crate::{
    Error, exact::Workspace, inputs::InputCourse, parameters::positive, state::State,
    system::Magnet,
};

impl Magnet {
    /// Advances the state over `size` (s) from `time` (s), while the inputs follow `course`.
    ///
    /// Where [`Magnet::is_exact`] holds the result is exact to rounding for any size; otherwise it
    /// is of fourth order in [`MagnetParameters::integration_step`](crate::MagnetParameters::integration_step). After an error the state is
    /// unchanged.
    ///
    /// # Errors
    /// A size that is not positive, inputs that are not finite, a gap that closes, or limits that
    /// chatter.
    #[inline]
    pub fn step(
        &self,
        state: &mut State,
        course: &InputCourse,
        time: f64,
        size: f64,
        workspace: &mut Workspace,
    ) -> Result<(), Error> {
        positive("step size (s)", size)?;
        course.check(time)?;
        self.check_offset(course.lateral_offset[0], time)?;
        if self.is_exact() {
            let [gap, _] = course.at(size);
            if gap <= 0.0 {
                return Err(Error::GapClosed { time: time + size, gap });
            }
            if self.parameters().external_controller {
                workspace.step_coil(self.linear_magnet(), state, course, size);
            } else {
                workspace.step(self.linear_magnet(), state, course, size);
            }
            state.time = time + size;
            return Ok(());
        }
        let mut next = *state;
        self.integrate(&mut next, course, time, size)?;
        next.time = time + size;
        *state = next;
        Ok(())
    }
}
