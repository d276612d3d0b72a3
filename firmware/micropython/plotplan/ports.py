"""Serial ports: bytes that have arrived, without waiting."""


class Port:
    """A `pyb.UART` or `pyb.USB_VCP`. ROOM is its receive buffer, less what a line may need in memory."""

    def __init__(self, device, room):
        self.device = device
        self.ROOM = room

    def read(self):
        count = self.device.any()
        return self.device.read(min(count, 64)) or b"" if count else b""

    def write(self, data):
        self.device.write(data)
