//! What an emulator of the HP 7475A must do, one test a point.

use super::*;

/// A plotter, its clock, and what it has answered.
struct Bench {
    plotter: Emulator,
    now_us: u64,
}

impl Bench {
    fn new() -> Self {
        Self { plotter: Emulator::new(), now_us: 0 }
    }

    fn send(&mut self, text: &str) {
        self.plotter.receive(text.as_bytes(), self.now_us);
    }

    fn wait(&mut self, us: u64) {
        self.now_us += us;
        self.plotter.advance(self.now_us);
    }

    fn heard(&mut self) -> String {
        String::from_utf8_lossy(&self.plotter.answers().concat()).into_owned()
    }

    /// Sends, waits until nothing moves, and returns the answers.
    fn ask(&mut self, text: &str) -> String {
        self.send(text);
        self.wait(50_000_000);
        self.heard()
    }

    fn lines(&self) -> Vec<(u16, Vec<[f64; 2]>)> {
        self.plotter.ink().lines()
    }
}

/// A line of about 20 seconds.
const SLOW: &str = "SP1;VS1;PU0,0;PD8000,0;";

#[test]
fn device_control_is_answered_while_the_buffer_is_full() {
    let mut bench = Bench::new();
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send(&"PD8000,10;PD8000,0;".repeat(60));
    bench.wait(2_000_000);
    bench.send("\u{1b}.B\u{1b}.O\u{1b}.E");
    bench.wait(20_000);
    // Full, busy, and bytes were lost.
    assert_eq!(bench.heard(), "0\r0\r16\r");
    bench.wait(60_000_000);
    assert_eq!(bench.ask("\u{1b}.B\u{1b}.E"), "1024\r0\r");
}

#[test]
fn room_rises_only_as_vectors_are_drawn() {
    let mut bench = Bench::new();
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send("PD8000,10;PD8000,4000;\u{1b}.B");
    bench.wait(100_000);
    let before = bench.heard();
    bench.wait(10_000_000);
    bench.send("\u{1b}.B");
    bench.wait(10_000);
    assert_eq!(bench.heard(), before);
    assert!(before.trim_end().parse::<u32>().is_ok_and(|room| room < 1024), "{before}");
    bench.wait(60_000_000);
    assert_eq!(bench.ask("\u{1b}.B"), "1024\r");
}

#[test]
fn bytes_arrive_at_9600_baud() {
    let mut bench = Bench::new();
    bench.send(&"PU;".repeat(100));
    bench.send("\u{1b}.B");
    bench.wait(300_000);
    assert_eq!(bench.heard(), "");
    bench.wait(20_000);
    assert_eq!(bench.heard(), "1024\r");
}

#[test]
fn kill_drops_buffer_and_half_instructions_only() {
    let mut bench = Bench::new();
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send("PD8000,500;PU0,0;PD1000,2");
    bench.wait(100_000);
    bench.send("\u{1b}.K");
    bench.wait(40_000_000);
    // The vector in execution is finished, the pen stays down.
    assert_eq!(bench.lines(), [(1, vec![[0.0, 0.0], [8000.0, 0.0]])]);
    assert_eq!(bench.ask("OA;"), "8000,0,1\r");
}

#[test]
fn buffer_size_is_sent_once_the_buffer_is_empty() {
    let mut bench = Bench::new();
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send("PD8000,500;\u{1b}.L");
    bench.wait(1_000_000);
    assert_eq!(bench.heard(), "");
    bench.wait(40_000_000);
    assert_eq!(bench.heard(), "1024\r");
}

#[test]
fn extended_status_of_buffer_view_and_lever() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("\u{1b}.O"), "8\r");
    bench.send(SLOW);
    bench.wait(3_000_000);
    // The last vector still moves.
    bench.send("\u{1b}.O");
    bench.wait(10_000);
    assert_eq!(bench.heard(), "8\r");
    bench.plotter.hold(true, bench.now_us);
    assert_eq!(bench.ask("PD1,1;\u{1b}.O"), "16\r");
    bench.plotter.hold(false, bench.now_us);
    bench.plotter.interpreter.set_lever(true, &mut bench.plotter.port.ink);
    assert_eq!(bench.ask("\u{1b}.O"), "40\r");
}

#[test]
fn queued_answers_wait_for_the_motion_before_them() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("OS;OS;"), "24\r16\r");
    bench.send(SLOW);
    bench.send("OA;ZZ;PA1;OE;OE;OI;OH;OP;OF;");
    bench.wait(4_000_000);
    assert_eq!(bench.heard(), "");
    bench.wait(40_000_000);
    // The first error since OE was last asked.
    assert_eq!(bench.heard(), "8000,0,1\r1\r0\r7475A\r0,0,11040,7721\r603,521,10603,7721\r40,40\r");
}

#[test]
fn handshake_defaults_and_xon_xoff() {
    let mut bench = Bench::new();
    // ENQ gets an ACK at once, and DTR stops the sender with fewer than 80 free bytes.
    assert_eq!(bench.ask("\u{5}"), "\u{6}");
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send(&"PD8000,10;".repeat(95));
    bench.wait(1_500_000);
    assert_eq!(bench.plotter.room(), 0);
    bench.wait(60_000_000);
    bench.send("\u{1b}.I81;;17:\u{1b}.N;19:\u{1b}.@;0:PD8000,0;PU0,0;VS1;PD8000,0;");
    bench.wait(25_000_000);
    bench.heard();
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send(&"PD8000,10;PD8000,9;".repeat(53));
    bench.wait(2_000_000);
    let mut heard = bench.heard();
    for _ in 0..600 {
        bench.wait(100_000);
        heard.push_str(&bench.heard());
    }
    assert_eq!(heard, "\u{13}\u{11}");
}

#[test]
fn turnaround_initiator_and_terminators() {
    let mut bench = Bench::new();
    bench.send("\u{1b}.M100;0;0;13;10;42:\u{1b}.B");
    // 1.1875 * 100 / 1.2 = 99 ms after the request.
    bench.wait(110_000);
    assert_eq!(bench.heard(), "");
    bench.wait(20_000);
    assert_eq!(bench.heard(), "*1024\r\n");
    assert_eq!(bench.ask("\u{1b}.R\u{1b}.B"), "1024\r");
}

#[test]
fn initialize_resets_errors_and_frame_but_not_the_pen() {
    let mut bench = Bench::new();
    bench.ask("SP3;PU100,200;PD300,200;ZZ;RO90;IP0,0,1,1;IW0,0,9,9;\u{1b}.I200:");
    assert_eq!(bench.ask("IN;OA;OE;OP;OW;OS;"), "300,200,0\r0\r603,521,10603,7721\r0,0,11040,7721\r24\r");
    bench.ask("PD400,200;");
    assert_eq!(bench.lines().last().map(|(pen, _)| *pen), Some(3));
}

#[test]
fn papers_rotation_clipping_and_odd_counts() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("PS0;OH;PS4;OH;PS200;OE;"), "0,0,16158,11040\r0,0,11040,7721\r3\r");
    bench.ask("SP1;PU100,100;PD12000,100,12000,300,200,300;PU0,0;");
    let clipped = [[[100.0, 100.0], [11_040.0, 100.0]], [[11_040.0, 300.0], [200.0, 300.0]]];
    assert_eq!(bench.lines().into_iter().map(|(_, points)| points).collect::<Vec<_>>(), clipped);
    assert_eq!(bench.ask("PU0,0;PA100,100,5;OA;OE;"), "100,100,0\r2\r");
    // A line feed ends an instruction.
    assert_eq!(bench.ask("PU7,7\nOA\n"), "7,7,0\r");
    assert_eq!(bench.ask("RO90;OH;IP;OP;"), "0,0,7721,11040\r0,610,7200,10610\r");
    assert_eq!(bench.ask("IN;PU40000,0;OE;"), "6\r");
}

#[test]
fn lever_empty_stalls_and_the_lift_after_55_seconds() {
    let mut bench = Bench::new();
    bench.plotter.interpreter.remove_pen(2);
    bench.ask("SP2;PU0,0;PD100,0;PU;");
    // The first pen found is taken, without an error.
    assert_eq!((bench.lines()[0].0, bench.ask("OE;")), (1, "0\r".to_owned()));
    bench.send("PD;");
    bench.wait(54_000_000);
    assert!(bench.plotter.pen_is_down());
    bench.wait(2_000_000);
    assert!(!bench.plotter.pen_is_down());
    bench.plotter.interpreter.set_lever(true, &mut bench.plotter.port.ink);
    assert_eq!(bench.ask("PA500,0;OE;"), "8\r");
}

#[test]
fn off_until_switched_on_and_seven_bits() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("\u{1b}.)OI;"), "");
    assert_eq!(bench.ask("\u{1b}.(OI;"), "7475A\r");
    bench.plotter.receive(&[b'O' | 0x80, b'I' | 0x80, b';'], bench.now_us);
    bench.wait(100_000);
    assert_eq!(bench.heard(), "7475A\r");
    assert_eq!(bench.ask("oi;\u{1b}.P1:\u{1b}.E"), "7475A\r11\r");
}

#[test]
fn power_cut_forgets_everything_but_the_place() {
    let mut bench = Bench::new();
    bench.ask("SP1;PU500,600;PD700,600;PU;OS;");
    bench.plotter.power_cut(bench.now_us);
    assert_eq!(bench.ask("OA;OS;"), "700,600,0\r24\r");
    assert_eq!(bench.lines().len(), 1);
}

#[test]
fn commanded_position_is_in_user_units() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("PU700,800;OC;"), "700,800,0\r");
    assert_eq!(bench.ask("IP0,0,1000,2000;SC0,10,0,10;PU5,2.5;OC;OA;"), "5.0000,2.5000,0\r500,500,0\r");
}

#[test]
fn block_mode_releases_a_block_without_errors() {
    let mut bench = Bench::new();
    bench.send("\u{1b}.@;17:SP1;PU0,0;PD400,0;PU;");
    bench.wait(10_000_000);
    assert_eq!(bench.lines(), []);
    assert_eq!(bench.ask("\u{1b}.E"), "0\r");
    assert_eq!(bench.lines().len(), 1);
    // A block with an error is thrown away, and may be sent again.
    bench.send("PU0,400;PD400,400;PU;");
    bench.wait(50_000);
    bench.plotter.is_damaged = true;
    bench.send("PU0,400;");
    bench.wait(50_000);
    assert_eq!(bench.ask("\u{1b}.E"), "15\r");
    assert_eq!(bench.lines().len(), 1);
    bench.send("PU0,400;PD400,400;PU;");
    assert_eq!(bench.ask("\u{1b}.E"), "0\r");
    assert_eq!(bench.lines().len(), 2);
}

#[test]
fn plotter_that_is_off_passes_bytes_on() {
    let mut bench = Bench::new();
    bench.send("\u{1b}.)PD400,0;\u{1b}.(SP1;PU0,0;PD400,400;PU;");
    bench.wait(10_000_000);
    assert_eq!(bench.plotter.passed, b"PD400,0;");
    assert_eq!(bench.lines().len(), 1);
}

#[test]
fn answers_wait_for_trigger_and_swallow_their_echo() {
    let mut bench = Bench::new();
    // Trigger DC1, the echo ends with CR.
    bench.send("\u{1b}.M;17;13;13:\u{1b}.B");
    bench.wait(1_000_000);
    assert_eq!(bench.heard(), "");
    bench.send("\u{11}");
    bench.wait(1_000_000);
    assert_eq!(bench.heard(), "1024\r");
    // The computer echoes the answer: none of it is HP-GL.
    bench.send("1024\r\u{1b}.M:OE;");
    bench.wait(1_000_000);
    assert_eq!(bench.heard(), "0\r");
}

#[test]
fn bytes_of_answers_have_a_gap() {
    let mut bench = Bench::new();
    // 1.1875 p / 1.2 ms: 100 ms for p = 101.
    bench.send("\u{1b}.N101:");
    bench.wait(100_000);
    bench.send("\u{1b}.B");
    bench.wait(4_000);
    assert_eq!(bench.heard(), "1");
    bench.wait(105_000);
    assert_eq!(bench.heard(), "0");
    bench.wait(400_000);
    assert_eq!(bench.heard(), "24\r");
}

#[test]
fn enquiry_that_waits_is_answered_at_once_with_the_text_of_esc_n() {
    let mut bench = Bench::new();
    bench.send("\u{1b}.I1000;5;6:\u{1b}.N;33:\u{1b}.@;0:");
    bench.send(SLOW);
    bench.wait(3_000_000);
    bench.send(&"PD8000,10;".repeat(10));
    bench.send("\u{5}");
    bench.wait(500_000);
    assert_eq!(bench.heard(), "!");
    bench.wait(60_000_000);
    assert_eq!(bench.heard(), "\u{6}");
}

#[test]
fn framing_error_is_latched_and_the_byte_mangled() {
    let mut bench = Bench::new();
    bench.plotter.is_damaged = true;
    bench.send("SP1;");
    bench.wait(100_000);
    assert_eq!(bench.ask("\u{1b}.E\u{1b}.E"), "15\r0\r");
    // `RP` is no instruction of this plotter.
    assert_eq!(bench.ask("OE;"), "1\r");
}
