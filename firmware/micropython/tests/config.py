"""The coaxial arm: `plotplan machine show coaxial --firmware-config micropython`, for the tests."""

NAME = "coaxial"
PERIOD_US = 5_000
HOME = (800, 0)
MUST_HOME = False
MOTORS = (
    {
        "driver": (3, "PA10", ("PB4", "PB5")),
        "reversed": False,
        "encoder": (8, ("PC6", "PC7")),
        "encoder_reversed": False,
        "ticks_s": 544,
        "lowest": -1000,
        "highest": 3000,
        "loop": {"kp": 1.5, "ki": 2.0, "ticks_s_percent": 106.67, "time_constant_s": 0.12, "friction": 6.0},
    },
    {
        "driver": (5, "PC1", ("PA0", "PA1")),
        "reversed": False,
        "encoder": (4, ("PB6", "PB7")),
        "encoder_reversed": False,
        "ticks_s": 544,
        "lowest": -2500,
        "highest": 2500,
        "loop": {"kp": 1.5, "ki": 2.0, "ticks_s_percent": 106.67, "time_constant_s": 0.12, "friction": 6.0},
    },
)
SERVO = (2, 1, "PA5")
PEN_UP_US = 1000
PEN_DOWN_US = 1500
