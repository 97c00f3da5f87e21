//! Gaussian splatting: the renderers `gaussians` and `gaussians-2d` against a plain renderer in f64, what must not
//! change their pictures, and graphs of splats and columns that are refused. All of it costs about 10 s on two cores.

mod agreement;
mod beside;
mod columns;
mod counted;
mod extremes;
mod per_pixel;
mod quads;
mod reference;
mod refused;
mod same;
mod scripted;
mod stage;
mod together;
mod ways;
