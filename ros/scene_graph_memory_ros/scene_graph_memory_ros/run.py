"""Runs the node, until a signal or a shutdown ends it."""

from __future__ import annotations

import signal
import sys


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped by SIGINT, SIGTERM or a shutdown; return its status."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while all is imported, nothing has to be saved
    import rclpy
    import yaml
    from rclpy.exceptions import ParameterException
    from rclpy.executors import ExternalShutdownException
    from rclpy.signals import SignalHandlerOptions, install_signal_handlers

    from scene_graph_memory_ros.node import MemoryNode

    ended = KeyboardInterrupt, ExternalShutdownException
    wrong = ValueError, KeyError, OSError, ModuleNotFoundError, ParameterException, yaml.YAMLError
    try:
        # While the node is made a signal interrupts Python. Handlers of rclpy would make ROS itself
        # invalid, and each call of it an error of its own.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = MemoryNode()
        try:
            install_signal_handlers(SignalHandlerOptions.ALL)
            rclpy.spin(node)
        except ended:
            pass
        node.finish()
        node.destroy_node()
    except ended:
        pass  # while it started: nothing was seen
    except wrong as error:
        text = str(error.args[0] if isinstance(error, KeyError) and error.args else error)
        print(f"error: {' '.join(text.split())}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    return 0
