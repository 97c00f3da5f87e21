//! The guide for authors of plugins: pages that lead from an idea to a plugin, and references. They lie as
//! files in `host/manual/plugins`, too, and their examples run in the tests.
//!
#![doc = include_str!("../../../manual/plugins/index.md")]

pub mod shading {
    #![doc = include_str!("../../../manual/plugins/shading.md")]
}

pub mod graph {
    #![doc = include_str!("../../../manual/plugins/graph.md")]
}

pub mod splats {
    #![doc = include_str!("../../../manual/plugins/splats.md")]
}

pub mod tool {
    #![doc = include_str!("../../../manual/plugins/tool.md")]
}

pub mod hands {
    #![doc = include_str!("../../../manual/plugins/hands.md")]
}

pub mod tracer {
    #![doc = include_str!("../../../manual/plugins/tracer.md")]
}

pub mod format {
    #![doc = include_str!("../../../manual/plugins/format.md")]
}

pub mod wire {
    #![doc = include_str!("../../../manual/plugins/wire.md")]
}

pub mod versions {
    #![doc = include_str!("../../../manual/plugins/versions.md")]
}

pub mod may_use {
    #![doc = include_str!("../../../manual/plugins/may-use.md")]
}

pub mod shaders {
    #![doc = include_str!("../../../manual/plugins/shaders.md")]
}
