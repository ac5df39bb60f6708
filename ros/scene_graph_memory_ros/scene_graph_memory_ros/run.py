"""Runs the node, until a signal or a shutdown ends it."""

from __future__ import annotations

import signal
import sys

_REMEDY = "Read the setup files of ROS and of the workspace, and activate the environment with sgm."
_PAUSE = 0.2  # seconds from a signal to the end, at most, while nothing comes


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped by SIGINT, SIGTERM or a shutdown; return its status."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while all is imported, nothing has to be saved
    try:
        import rclpy
        from rclpy.exceptions import ParameterException
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
        from rclpy.signals import SignalHandlerOptions

        from scene_graph_memory_ros.node import MemoryNode
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        print(f"error: package {package} must be there, got none. {_REMEDY}", file=sys.stderr)
        return 1

    ended = KeyboardInterrupt, ExternalShutdownException
    wrong = ValueError, KeyError, OSError, ModuleNotFoundError, ParameterException
    try:
        # While the node is made a signal interrupts Python, later it ends the loop. Handlers of
        # rclpy would make ROS itself invalid, and each call and each line of the log an error.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:  # rcl's, of arguments that it cannot read
            raise ValueError(error) from error
        node, signals = MemoryNode(), []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, frame: signals.append(number))
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        try:
            while rclpy.ok() and not signals:
                executor.spin_once(timeout_sec=_PAUSE)
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
