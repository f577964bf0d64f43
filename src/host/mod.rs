//! All that touches the system: clock, ports, pseudo-terminals, terminal, files. Thin: decisions are made elsewhere.
