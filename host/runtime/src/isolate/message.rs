//! What a program and the processes of its plugins say to each other.

use super::clouds::CloudHead;
use crate::boundary::Fault;
use serde::{Deserialize, Serialize};
use surfelshop_api::Tile;

/// The one argument of a program that is started for a library.
pub const ARGUMENT: &str = "isolated-plugin";

/// How a process exits that cannot tell the program what it was asked for.
pub(super) const CUT: i32 = 71;

/// What a program has a process do. Each is answered by [`Ask::Done`], after any number of other questions.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Order {
    /// Load a library. Parts: its path; the path that people know it by.
    Load,
    /// Have a unit describe itself.
    Describe(u32),
    /// Make the instance that the other orders are for. Part: what it is made from.
    Create(u32),
    /// Describe a frame. Part: the request.
    Frame,
    /// Fill a tile. Parts: the request; the columns and triangles of the clouds, and the light. Without the clouds they are
    /// those of the tile before. What comes back with the channels are the pixels.
    Tile(Tile, Option<Vec<CloudHead>>),
    /// Run a tool. Parts: the request; columns and triangles of the cloud.
    Run(CloudHead),
    /// Read a file of this name. Part: the request.
    Read(String),
    /// Write a file of this name. Part: the request.
    Write(String),
}

/// What a process asks or tells.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Ask {
    /// Progress; part: the message. Nobody answers.
    Progress(f64),
    /// Whether somebody asked to stop.
    Cancelled,
    /// Take an edit. Parts: the header; its values.
    Stage,
    /// Run a graph. Parts: structure; data.
    Compute(Vec<u32>),
    /// How long the file is.
    Length,
    /// Read so many bytes of the file from here.
    ReadAt(u64, u64),
    /// Write bytes of the file. Part: the bytes.
    WriteAt(u64),
    /// Take the header of a cloud. Part: the header.
    Begin,
    /// Take points. Parts: the columns.
    Batch,
    /// Take triangles. Part: their corners.
    Faces,
    /// Take a line for people. Part: the line. Nobody answers.
    Warn,
    /// The header of the next cloud.
    NextCloud,
    /// The next points of it.
    NextBatch,
    /// The order is done. Parts: the channels; the pixels of a tile.
    Done(Outcome),
}

/// What a program answers.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Reply {
    /// It is done; parts are what was asked for.
    Done,
    /// It is not; says why.
    Refused(String),
    /// Yes or no.
    Is(bool),
    /// So many.
    Count(u64),
    /// Points. Parts: columns and triangles.
    Points(Option<CloudHead>),
}

/// How an order ended.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Outcome {
    fault: Option<(u8, String)>,
    /// The minor version of the interface that the library speaks, where an instance was made.
    pub(super) minor: u16,
    /// The channels that were written.
    pub(super) channels: Vec<u32>,
}

impl Outcome {
    pub(super) fn new(done: Result<u16, Fault>, channels: Vec<u32>) -> Self {
        let (minor, fault) = match done {
            Ok(minor) => (minor, None),
            Err(Fault::Panic(line)) => (0, Some((1, line))),
            Err(Fault::Misbehaved(line)) => (0, Some((2, line))),
            Err(Fault::Error(line) | Fault::NotAsked(line)) => (0, Some((0, line))),
            Err(late @ Fault::TimedOut(_)) => (0, Some((0, late.to_string()))),
        };
        Self { fault, minor, channels }
    }

    /// What it says of the call.
    pub(super) fn result(self) -> Result<u16, Fault> {
        match self.fault {
            None => Ok(self.minor),
            Some((1, line)) => Err(Fault::Panic(line)),
            Some((2, line)) => Err(Fault::Misbehaved(line)),
            Some((_, line)) => Err(Fault::Error(line)),
        }
    }
}
