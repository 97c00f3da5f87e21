//! File formats of plugins: hostile ones are contained, and clouds come through as they are.

mod convert;
mod facts;
mod heads;
mod hostile_reads;
mod hostile_writes;
mod in_memory;
mod round_trips;
mod scans;
mod stage;
