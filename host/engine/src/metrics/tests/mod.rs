mod agreement;
mod analytic;
mod pictures;
mod refusals;
mod twin;
mod variance;
