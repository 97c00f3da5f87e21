//! Gaussian splatting: the renderers `gaussians` and `gaussians-2d` against a plain renderer in f64, what must not
//! change their pictures, and graphs of splats and columns that are refused. All of it costs about 10 s on two cores.

mod agreement;
mod beside;
mod columns;
mod counted;
mod extremes;
mod hostile_footprints;
mod per_pixel;
mod quads;
mod refused;
mod same;
mod scripted;
mod stage;
mod together;
mod ways;

pub(crate) use surfelshop_tests::gaussians::reference;
