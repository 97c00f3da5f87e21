//! What is compared, each with a device and an engine of its own.

use crate::bench::BenchArguments;
use anyhow::bail;
use clap::ValueEnum as _;
use serde_json::{Value, json};
use surfelshop_session::options::{DeviceArguments, SurfelChoice};
use surfelshop_session::output::terminal;
use surfelshop_session::session::RenderSession;
use surfelshop_session::setup::RenderSetup;

/// One way to make the same picture. Whatever else pictures may be made with, such as a level of
/// detail, becomes a field here and a part of the name; nothing else in this folder asks how variants
/// differ.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variant {
    /// As in tables, and as it is typed.
    pub(super) name: String,
    pub(super) surfels: SurfelChoice,
    /// Radius of merged surfels in pixels; 0 where none are.
    pub(super) detail_px: f32,
}

impl Variant {
    /// One for each way to draw surfels, and for each detail where surfels are merged.
    pub(super) fn all(strategies: &[SurfelChoice], details: &[f32]) -> Vec<Self> {
        let mut all = Vec::new();
        for &surfels in strategies {
            let value = surfels.to_possible_value();
            let way = value.map_or_else(String::new, |value| value.get_name().to_owned());
            for &detail_px in details {
                let name = match detail_px {
                    0.0 => way.clone(),
                    _ => format!("{way} at {detail_px} px"),
                };
                all.push(Self { name, surfels, detail_px });
            }
        }
        all
    }

    /// What is drawn, with this detail.
    pub(super) fn staging(&self, staging: &RenderSetup) -> RenderSetup {
        // Where nothing is said pyramids are merged all the same.
        let of_pyramids =
            if self.detail_px > 0.0 { self.detail_px } else { staging.pyramid_detail_px };
        let (detail_px, pyramid_detail_px) = (self.detail_px, of_pyramids);
        RenderSetup { detail_px, pyramid_detail_px, ..staging.clone() }
    }

    /// The device with this way to draw.
    fn device(&self, typed: &DeviceArguments) -> DeviceArguments {
        DeviceArguments { surfels: self.surfels, ..typed.clone() }
    }

    /// Options of `render` for this way to draw.
    pub(super) fn options(&self) -> [String; 4] {
        let value = self.surfels.to_possible_value();
        let way = value.map_or_else(String::new, |value| value.get_name().to_owned());
        ["--surfels".to_owned(), way, "--detail".to_owned(), self.detail_px.to_string()]
    }
}

/// The variant that the others' times are divided by: quads, or else the first.
pub(super) fn base(variants: &[Variant]) -> String {
    let quads = variants.iter().find(|variant| variant.surfels == SurfelChoice::Quads);
    quads.or(variants.first()).map_or_else(String::new, |variant| variant.name.clone())
}

/// A variant that draws.
pub(super) struct Contestant {
    pub(super) variant: Variant,
    pub(super) studio: RenderSession,
}

/// Variants that could not draw, and why.
#[derive(Default)]
pub(super) struct LeftOut {
    reasons: Vec<(String, String)>,
    alike: Vec<(String, String)>,
}

impl LeftOut {
    /// Says so, each reason once.
    pub(super) fn add(&mut self, variant: &Variant, reason: &anyhow::Error) {
        let new = (variant.name.clone(), format!("{reason:#}"));
        if !self.reasons.contains(&new) {
            terminal::note(format!("{} is left out: {}", new.0, new.1));
            self.reasons.push(new);
        }
    }

    /// Says that two variants are the same on this device, once: a device may lack what one of them is
    /// made for, and is then measured twice.
    pub(super) fn alike(&mut self, variant: &str, other: &str) {
        let both = (variant.to_owned(), other.to_owned());
        if !self.alike.contains(&both) {
            terminal::note(format!("{variant} draws surfels by the same passes as {other} here"));
            self.alike.push(both);
        }
    }

    /// The last reason, for where nothing is left.
    pub(super) fn last(&self) -> anyhow::Error {
        let reason = self.reasons.last().map(|(name, reason)| format!("{name}: {reason}"));
        anyhow::anyhow!(reason.unwrap_or_else(|| "there is nothing to measure".to_owned()))
    }

    pub(super) fn object(&self) -> Value {
        let each =
            |(variant, reason): &(String, String)| json!({ "variant": variant, "reason": reason });
        self.reasons.iter().map(each).collect()
    }
}

/// Opens a device for each variant; those that cannot are left out.
pub(super) fn open(
    arguments: &BenchArguments,
    variants: &[Variant],
    left_out: &mut LeftOut,
) -> anyhow::Result<Vec<Contestant>> {
    let mut all = Vec::with_capacity(variants.len());
    for variant in variants {
        match RenderSession::open(&variant.device(&arguments.device), &arguments.plugins) {
            Ok(studio) => all.push(Contestant { variant: variant.clone(), studio }),
            Err(error) => left_out.add(variant, &error),
        }
    }
    if all.is_empty() {
        bail!(left_out.last());
    }
    Ok(all)
}
