//! What is held for frames to come, and letting go of it where they are of other sizes.

use crate::engine::Engine;

impl Engine {
    /// Lets go of what was made for pictures of other sizes than these, in pixels, once no other is shown
    /// any more: kept for good, the largest picture ever shown would say how much memory the program
    /// takes. Frames of any size can be drawn afterwards; they make anew what they need.
    pub fn keep_sizes(&mut self, sizes: &[[u32; 2]]) {
        self.surfaces.keep_sizes(sizes);
        self.resources.keep_sizes(sizes);
        self.gpu.transfers.clear();
        // What nobody holds any more goes when the device is asked the next time.
        if let Err(error) = self.gpu.device.poll(wgpu::PollType::Poll) {
            tracing::debug!("memory of the device was not let go: {error}");
        }
    }
}
