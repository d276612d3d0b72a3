//! Arbitrary bytes, bare and behind the head of a plan: reading a plan never panics, and a plan that
//! is read can be written as tick lines, is read back as the same table, and can be verified.
#![no_main]

use std::sync::LazyLock;

use compiler::machine_file::{MachineFile, PRESETS};
use compiler::replay;
use kinematics::Machine;
use libfuzzer_sys::fuzz_target;
use plan::file::{read, tick_lines};

const BEGINNINGS: [&[u8]; 3] = [
    b"",
    b"; plotplan: 1\n; machine: corexy\n; motors: A B\n; placement a b: 1 0\n; placement c d: 0 1\n; \
      placement e f: 0 0\n; period_us: 10000\n",
    b"# plotplan: 1\n# machine: corexy\n# placement: 1 0 0 1 0 0\n# period_us: 10000\nt_us,pen,A,B\n",
];

/// More rows are read and written, but not verified: each may take 10,000 chords.
const MOST_ROWS: usize = 100;
/// Ticks beyond this are not verified: ink of kilometres takes long to measure.
const FARTHEST_TICKS: i64 = 100_000;

static MACHINE: LazyLock<Machine> = LazyLock::new(|| {
    let preset = PRESETS.iter().find(|preset| preset.name == "corexy").expect("a preset");
    MachineFile::parse(preset.toml).expect("a machine file").machine().expect("a machine")
});

fuzz_target!(|bytes: &[u8]| {
    for beginning in BEGINNINGS {
        let Ok(plan) = read(&[beginning, bytes].concat()) else { continue };
        let mut written = Vec::new();
        if tick_lines::write(&plan.table.header, plan.table.rows.iter().copied(), &mut written).is_ok() {
            let again = read(&written).expect("a plan that was written is read");
            assert_eq!(again.table, plan.table);
        }
        let near =
            plan.table.rows.iter().all(|row| row.ticks.iter().all(|ticks| ticks.abs() < FARTHEST_TICKS));
        if near && plan.table.rows.len() <= MOST_ROWS {
            let certificate = replay::certify(&plan, &MACHINE, None, 0.1);
            assert_eq!(certificate.holds, certificate.failures.is_empty());
        }
    }
});
