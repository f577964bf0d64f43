//! Programs that nobody here wrote.

use std::io::Write;
use std::path::PathBuf;

/// A Python that has these modules, for `what`: a client, a server, a reader. Where nobody names one, that is said, and
/// the test skipped.
pub fn python(what: &str, modules: &str) -> Option<PathBuf> {
    let python = std::env::var_os("AXCON_TEST_PYTHON").map(PathBuf::from);
    if python.is_none() {
        // Straight to the stream: what the test harness captures of a test that passes is never seen.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no foreign {what}; set AXCON_TEST_PYTHON to a Python with {modules}, as .ci/run does"
        );
    }
    python
}
