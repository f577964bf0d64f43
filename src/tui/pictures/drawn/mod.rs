//! What a person reads, screen by screen, held in snapshots at the smallest size and at a large one.

mod bench;
mod connect;
mod dictionary;
mod load;
mod overview;
mod recordings;
mod stream;
mod terminal;
