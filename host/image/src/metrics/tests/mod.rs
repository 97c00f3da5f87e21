mod agreement;
mod analytic;
mod pictures;
mod pooled;
mod refusals;
mod twin;
mod values;
mod variance;
