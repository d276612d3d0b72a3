//! Arbitrary text as a machine file: parsing never panics, and a machine that is accepted has inverse
//! kinematics that agree with its forward kinematics all over its sheet.
#![no_main]

use compiler::machine_file::MachineFile;
use drawing::Point;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(file) = MachineFile::parse(text) else { return };
    let Ok(machine) = file.machine() else { return };
    let _ = file.drive(&machine);
    let sheet = machine.sheet();
    let mechanism = machine.mechanism();
    for k in 0..25 {
        let share = |k: i32| f64::from(k) / 4.0;
        let p = Point::new(sheet.x0 + share(k % 5) * sheet.width(), sheet.y0 + share(k / 5) * sheet.height());
        let Ok(q) = mechanism.inverse(p) else { continue };
        assert!(q.is_finite(), "{q:?} at {p:?} of {mechanism:?}");
        // Near singular poses and far from the base digits are lost.
        if mechanism.manipulability(&q) > 1e-3 {
            let size = p.to_vec2().hypot() + machine.start().abs()[0] + 1.0;
            let off = (mechanism.forward(&q) - p).hypot();
            assert!(off < 1e-6 * size, "{off} mm off at {p:?} of {mechanism:?}");
        }
    }
});
