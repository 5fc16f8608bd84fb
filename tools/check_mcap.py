#!/usr/bin/env python3
"""Reads an Instep recording with independent readers and fails if anything does not decode.

    pip install mcap mcap-ros2-support rosbags
    python3 tools/check_mcap.py trial.mcap

The first reader is `mcap` with `mcap-ros2-support` (decodes by the schemas in the file, checks the CRCs). The second is
`rosbags` with its own definitions of the standard messages; it is skipped, and said to be, if it is not installed.
"""

import math
import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

TYPES = {
    "/joint_states": "sensor_msgs/msg/JointState",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/ball": "geometry_msgs/msg/PoseStamped",
    "/imu": "sensor_msgs/msg/Imu",
    "/events": "std_msgs/msg/String",
    "/camera/image/compressed": "sensor_msgs/msg/CompressedImage",
    "/camera/annotations": "foxglove_msgs/msg/ImageAnnotations",
}


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + (stamp.nanosec if hasattr(stamp, "nanosec") else stamp.nanosecond)


def unit(q):
    return math.isclose(math.hypot(q.x, q.y, q.z, q.w), 1.0, abs_tol=1e-3)


def check_message(topic, log_time, message):
    """What is wrong with one decoded message, or None."""
    headers = [t.header for t in message.transforms] if topic == "/tf" else [message.header] if hasattr(message, "header") else []
    if any(nanoseconds(header.stamp) != log_time for header in headers):
        return "stamp differs from log time"
    if topic == "/joint_states":
        n = len(message.name)
        if len(message.position) != n or any(len(x) not in (0, n) for x in (message.velocity, message.effort)):
            return "lists of unequal length"
        if not all(map(math.isfinite, [*message.position, *message.velocity, *message.effort])):
            return "a value is not finite"
    if topic == "/tf" and not all(unit(t.transform.rotation) for t in message.transforms):
        return "a rotation is not a unit quaternion"
    if topic == "/ball" and not unit(message.pose.orientation):
        return "the orientation is not a unit quaternion"
    if topic == "/camera/image/compressed" and bytes(message.data[:8]) != b"\x89PNG\r\n\x1a\n":
        return "the image is no PNG file"
    if topic == "/camera/annotations" and any(len(points.points) != 4 for points in message.points):
        return "a box without four corners"
    if topic == "/events" and not message.data:
        return "empty event"
    return None


def check_with_mcap(path):
    problems, counts, last = [], Counter(), {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        profile = reader.get_header().profile
        if profile != "ros2":
            problems.append(f"profile is {profile!r}, not 'ros2'")
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            topic = channel.topic
            counts[topic] += 1
            if schema.name != TYPES.get(topic):
                problems.append(f"{topic}: type {schema.name}, wanted {TYPES.get(topic)}")
            if message.log_time < last.get(topic, 0):
                problems.append(f"{topic}: time runs backwards at {message.log_time} ns")
            last[topic] = message.log_time
            wrong = check_message(topic, message.log_time, decoded)
            if wrong:
                problems.append(f"{topic} at {message.log_time} ns: {wrong}")
        stated = reader.get_summary().statistics.message_count
    if stated != sum(counts.values()):
        problems.append(f"the file states {stated} messages, {sum(counts.values())} were read")
    return counts, problems


def check_with_rosbags(path):
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    problems, counts = [], Counter()
    with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, log_time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            counts[connection.topic] += 1
            wrong = check_message(connection.topic, log_time, message)
            if wrong:
                problems.append(f"{connection.topic} at {log_time} ns (rosbags): {wrong}")
    return counts, problems


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: check_mcap.py FILE.mcap")
    path = sys.argv[1]
    counts, problems = check_with_mcap(path)
    if not counts:
        problems.append("no message at all")
    try:
        again, more = check_with_rosbags(path)
        problems += more
        if again != counts:
            problems.append(f"mcap read {dict(counts)}, rosbags {dict(again)}")
        second = "mcap and rosbags agree"
    except ImportError:
        second = "rosbags is not installed: read with mcap only"
    for topic, count in sorted(counts.items()):
        print(f"{topic:15} {count:6}  {TYPES.get(topic, '?')}")
    for problem in problems[:20]:
        print("wrong:", problem, file=sys.stderr)
    if problems:
        sys.exit(f"{path}: {len(problems)} problems")
    print(f"{path}: {sum(counts.values())} messages, all decode; {second}")


if __name__ == "__main__":
    main()
