#!/usr/bin/env python3
"""An independent DDS implementation calls the node: Eclipse Cyclone DDS through its Python package (PyPI: cyclonedds).

Run by tests/it/cyclone.rs against a node with a simulated Wolfgang; by hand:

    instep ros --robot wolfgang --simulate --domain 77 --rmw rmw_cyclonedds_cpp &
    venv/bin/python cyclone_client.py --domain 77 --mapping cyclone

It speaks as the ROS 2 middlewares do on the wire: names and types mangled as rmw does, plain CDR, and for services
either rmw_cyclonedds' request header (`--mapping cyclone`) or none (`--mapping enhanced`, where replies are matched by
their order, because this package cannot set the related sample identity). Ends with code 0 and one JSON object of
measures on standard output, or with a message that says what was expected and what was seen.
"""

import argparse
import json
import math
import os
import random
import socket
import sys
import time
import types
from dataclasses import dataclass

URI = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>11</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
<Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>"""
os.environ.setdefault("CYCLONEDDS_URI", URI)

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int8, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

ACTION = "dynamic_kick/_action"
SUCCESS, UNREACHABLE, ABORTED, REJECTED = range(4)
UNKNOWN, ACCEPTED, EXECUTING, CANCELING, STATUS_SUCCEEDED, STATUS_CANCELED, STATUS_ABORTED = range(7)


def message(name):
    """A ROS 2 message: a final struct with rmw's type name."""
    package, kind, base = name.split("/")

    def make(cls):
        fields = {"__annotations__": cls.__annotations__, "__module__": __name__}
        fields |= {name: getattr(cls, name) for name in cls.__annotations__ if hasattr(cls, name)}
        named = {"typename": f"{package}.{kind}.dds_.{base}_"}
        return final(dataclass(types.new_class(base, (IdlStruct,), named, lambda body: body.update(fields))))

    return make


@message("builtin_interfaces/msg/Time")
class Time:
    sec: int32 = 0
    nanosec: uint32 = 0


@message("std_msgs/msg/Header")
class Header:
    stamp: Time
    frame_id: str


@message("geometry_msgs/msg/Point")
class Point:
    x: float64
    y: float64
    z: float64


@message("geometry_msgs/msg/Quaternion")
class Quaternion:
    x: float64
    y: float64
    z: float64
    w: float64


@message("geometry_msgs/msg/Transform")
class Transform:
    translation: Point
    rotation: Quaternion


@message("geometry_msgs/msg/TransformStamped")
class TransformStamped:
    header: Header
    child_frame_id: str
    transform: Transform


@message("tf2_msgs/msg/TFMessage")
class TFMessage:
    transforms: sequence[TransformStamped]


@message("bitbots_msgs/msg/JointCommand")
class JointCommand:
    header: Header
    from_hcm: bool
    joint_names: sequence[str]
    positions: sequence[float64]
    velocities: sequence[float64]
    accelerations: sequence[float64]
    max_currents: sequence[float64]


@message("biped_interfaces/msg/Phase")
class Phase:
    header: Header
    phase: uint8


@message("bitbots_msgs/action/Kick_Goal")
class KickGoal:
    header: Header
    ball_position: Point
    kick_direction: Quaternion
    kick_speed: float64
    unstable: bool


@message("action_msgs/msg/GoalInfo")
class GoalInfo:
    goal_id: array[uint8, 16]
    stamp: Time


@message("action_msgs/msg/GoalStatus")
class GoalStatus:
    goal_info: GoalInfo
    status: int8


@message("action_msgs/msg/GoalStatusArray")
class GoalStatusArray:
    status_list: sequence[GoalStatus]


@message("bitbots_msgs/action/Kick_FeedbackMessage")
class FeedbackMessage:
    goal_id: array[uint8, 16]
    chosen_foot: uint8
    percent_done: uint8


# Requests and responses, with rmw_cyclonedds' header and without. The header is the client's identity and a number.


def service(request, response):
    """The fields of a service, as (request, response) types for each mapping."""
    header = {"guid": uint64, "seq": int64}

    def make(name, fields):
        return message(name)(type(name.rsplit("/", 1)[-1], (), {"__annotations__": fields}))

    return {
        "cyclone": [make(name, header | fields) for name, fields in (request, response)],
        "enhanced": [make(name, fields) for name, fields in (request, response)],
    }


SEND_GOAL = service(
    ("bitbots_msgs/action/Kick_SendGoal_Request", {"goal_id": array[uint8, 16], "goal": KickGoal}),
    ("bitbots_msgs/action/Kick_SendGoal_Response", {"accepted": bool, "stamp": Time}),
)
GET_RESULT = service(
    ("bitbots_msgs/action/Kick_GetResult_Request", {"goal_id": array[uint8, 16]}),
    ("bitbots_msgs/action/Kick_GetResult_Response", {"status": int8, "result": uint8}),
)
CANCEL = service(
    ("action_msgs/srv/CancelGoal_Request", {"goal_info": GoalInfo}),
    ("action_msgs/srv/CancelGoal_Response", {"return_code": int8, "goals_canceling": sequence[GoalInfo]}),
)


def qos(depth, latched=False, reliable=True):
    """As rmw maps it; ROS 2 sends plain CDR, that is XCDR 1."""
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


class Failed(Exception):
    """What was expected did not happen."""


def expect(seen, wanted, what):
    if seen != wanted:
        raise Failed(f"{what}: expected {wanted}, saw {seen}")


def within(seconds, attempt, what):
    """The first true answer of `attempt` in so many seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = attempt()
        if answer:
            return answer
        time.sleep(0.0005)
    raise Failed(f"{what}: nothing in {seconds} s")


class Client:
    """A ROS 2 service client."""

    def __init__(self, participant, name, types, with_header):
        self.request_type, response_type = types
        self.with_header = with_header
        request = Topic(participant, f"rq/{name}Request", self.request_type)
        reply = Topic(participant, f"rr/{name}Reply", response_type)
        self.writer = DataWriter(participant, request, qos(16))
        self.reader = DataReader(participant, reply, qos(16))
        self.identity = random.getrandbits(63)
        self.sent = 0

    def matched(self):
        return self.writer.get_matched_subscriptions() and self.reader.get_matched_publications()

    def send(self, **fields):
        self.sent += 1
        if self.with_header:
            fields = {"guid": self.identity, "seq": self.sent} | fields
        self.writer.write(self.request_type(**fields))
        return self.sent

    def reply(self, seconds, what):
        """The reply to the last request."""

        def look():
            for sample in self.reader.take(16):
                if not self.with_header or (sample.guid, sample.seq) == (self.identity, self.sent):
                    return sample
            return None

        return within(seconds, look, what)

    def call(self, what, **fields):
        self.send(**fields)
        return self.reply(5, what)


class Robot:
    """The node, as its clients see it."""

    def __init__(self, domain, mapping):
        self.participant = DomainParticipant(domain)
        header = mapping == "cyclone"
        self.goal = Client(self.participant, f"{ACTION}/send_goal", SEND_GOAL[mapping], header)
        self.result = Client(self.participant, f"{ACTION}/get_result", GET_RESULT[mapping], header)
        self.cancel = Client(self.participant, f"{ACTION}/cancel_goal", CANCEL[mapping], header)
        self.feedback = self.reader(f"{ACTION}/feedback", FeedbackMessage, qos(1000))
        self.status = self.reader(f"{ACTION}/status", GoalStatusArray, qos(1, latched=True))
        self.commands = self.reader("kick_motor_goals", JointCommand, qos(5000))
        self.support = self.reader("dynamic_kick_support_state", Phase, qos(5000))
        topic = Topic(self.participant, "rt/tf_static", TFMessage)
        self.tf_static = DataWriter(self.participant, topic, qos(1, latched=True))
        self.clients = [self.goal, self.result, self.cancel]
        within(20, lambda: all(client.matched() for client in self.clients), "discovery of the action")
        within(20, self.commands.get_matched_publications, "discovery of kick_motor_goals")
        within(20, self.tf_static.get_matched_subscriptions, "discovery of tf_static")
        time.sleep(0.3)

    def reader(self, name, kind, quality):
        return DataReader(self.participant, Topic(self.participant, f"rt/{name}", kind), quality)

    def kick(self, frame="base_footprint", ball=(0.2, -0.05, 0.0), yaw=0.0, speed=0.7, what="a goal"):
        """Sends a goal; gives its identity and whether it was accepted."""
        identity = [random.randrange(256) for _ in range(16)]
        goal = KickGoal(
            header=Header(stamp=Time(), frame_id=frame),
            ball_position=Point(*ball),
            kick_direction=Quaternion(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)),
            kick_speed=speed,
            unstable=False,
        )
        reply = self.goal.call(what, goal_id=identity, goal=goal)
        return identity, reply.accepted

    def ended(self, identity, what, seconds=20):
        """State and result of a goal that ends."""
        self.result.send(goal_id=identity)
        reply = self.result.reply(seconds, what)
        return reply.status, reply.result

    def cancelled(self, identity):
        """The return code of a cancel, and how many goals it cancels."""
        info = GoalInfo(goal_id=identity, stamp=Time())
        reply = self.cancel.call("a cancel", goal_info=info)
        return reply.return_code, len(reply.goals_canceling)

    def idle(self):
        """Waits until the foot is down again."""
        def over():
            for sample in self.status.read(1):
                return all(goal.status >= STATUS_SUCCEEDED for goal in sample.status_list)
            return False

        within(10, over, "the end of every goal")
        for reader in (self.commands, self.feedback, self.support):
            reader.take(5000)


def check_names(robot):
    """Every endpoint of the node under the name and type that a real ROS 2 peer would look for."""
    wanted = {
        ("pub", "rr/dynamic_kick/_action/send_goalReply", "bitbots_msgs::action::dds_::Kick_SendGoal_Response_"),
        ("sub", "rq/dynamic_kick/_action/send_goalRequest", "bitbots_msgs::action::dds_::Kick_SendGoal_Request_"),
        ("pub", "rr/dynamic_kick/_action/get_resultReply", "bitbots_msgs::action::dds_::Kick_GetResult_Response_"),
        ("sub", "rq/dynamic_kick/_action/get_resultRequest", "bitbots_msgs::action::dds_::Kick_GetResult_Request_"),
        ("pub", "rr/dynamic_kick/_action/cancel_goalReply", "action_msgs::srv::dds_::CancelGoal_Response_"),
        ("sub", "rq/dynamic_kick/_action/cancel_goalRequest", "action_msgs::srv::dds_::CancelGoal_Request_"),
        ("pub", "rt/dynamic_kick/_action/feedback", "bitbots_msgs::action::dds_::Kick_FeedbackMessage_"),
        ("pub", "rt/dynamic_kick/_action/status", "action_msgs::msg::dds_::GoalStatusArray_"),
        ("pub", "rt/kick_motor_goals", "bitbots_msgs::msg::dds_::JointCommand_"),
        ("pub", "rt/dynamic_kick_support_state", "biped_interfaces::msg::dds_::Phase_"),
        ("sub", "rt/tf", "tf2_msgs::msg::dds_::TFMessage_"),
        ("sub", "rt/tf_static", "tf2_msgs::msg::dds_::TFMessage_"),
        ("pub", "rt/rosout", "rcl_interfaces::msg::dds_::Log_"),
        ("pub", "ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"),
    }
    own = robot.participant.guid
    seen = set()
    for side, topic in (("pub", BuiltinTopicDcpsPublication), ("sub", BuiltinTopicDcpsSubscription)):
        for endpoint in BuiltinDataReader(robot.participant, topic).take(500):
            if endpoint.participant_key != own:
                seen.add((side, endpoint.topic_name, endpoint.type_name))
    expect(sorted(wanted - seen), [], "endpoints that are missing or have another name or type")
    return len(seen)


def check_kick(robot, measures):
    """A kick from goal to result, with feedback, commands and a rejection on the way."""
    robot.idle()
    start = time.monotonic()
    identity, accepted = robot.kick(what="the first goal")
    expect(accepted, True, "a good goal")
    within(5, lambda: robot.commands.read(1), "the first joint command")
    measures["first_command_s"] = time.monotonic() - start
    expect(robot.kick(what="a goal during a kick")[1], False, "a goal during a kick")
    expect(robot.ended(identity, "the first kick"), (STATUS_SUCCEEDED, SUCCESS), "state and result of a kick")

    feedback = [sample for sample in robot.feedback.take(1000) if list(sample.goal_id) == identity]
    percent = [sample.percent_done for sample in feedback]
    if len(feedback) < 20 or percent != sorted(percent) or percent[-1] != 100:
        raise Failed(f"feedback: expected at least 20 that rise to 100 %, saw {percent}")
    expect({sample.chosen_foot for sample in feedback}, {1}, "the foot for a ball on the right")
    commands = robot.commands.take(5000)
    expect({len(command.positions) for command in commands}, {20}, "joints in each command")
    expect(all(math.isfinite(x) for command in commands for x in command.positions), True, "finite joint targets")
    expect(commands[0].velocities, [-1.0] * 20, "velocities that stand for the greatest")
    stamps = [command.header.stamp.sec + 1e-9 * command.header.stamp.nanosec for command in commands]
    gaps = sorted(abs(b - a - 0.002) for a, b in zip(stamps, stamps[1:]))
    measures["commands"] = len(commands)
    measures["tick_jitter_p99_s"] = gaps[int(0.99 * len(gaps))]
    support = {sample.phase for sample in robot.support.take(5000)}
    expect(support, {0, 2}, "support states of a kick with the right foot")


def check_rejections(robot):
    """Goals that cannot be: each refused, and the node none the worse."""
    nan = float("nan")
    for what, arguments in [
        ("a ball at NaN", {"ball": (nan, 0.0, 0.0)}),
        ("an infinite speed", {"speed": float("inf")}),
        ("no speed", {"speed": 0.0}),
        ("an unknown frame", {"frame": "the moon"}),
        ("an empty header", {"frame": ""}),
        ("a direction of NaN", {"yaw": nan}),
    ]:
        identity, accepted = robot.kick(what=what, **arguments)
        expect(accepted, False, what)
        expect(robot.ended(identity, what, 5), (UNKNOWN, REJECTED), f"the result of a rejected goal ({what})")
    identity, accepted = robot.kick(ball=(3.0, 0.0, 0.0), what="a ball far away")
    expect(accepted, True, "a ball far away")
    expect(robot.ended(identity, "a ball far away", 5), (STATUS_ABORTED, UNREACHABLE), "a ball far away")


def check_cancel(robot, measures):
    """A cancel is honoured at once, and every code is the right one."""
    identity, accepted = robot.kick(what="a goal to be cancelled")
    expect(accepted, True, "a goal to be cancelled")
    expect(robot.cancelled([9] * 16), (2, 0), "a cancel of an unknown goal")
    time.sleep(0.4)
    start = time.monotonic()
    expect(robot.cancelled(identity), (0, 1), "a cancel")
    expect(robot.ended(identity, "a cancelled kick"), (STATUS_CANCELED, ABORTED), "state and result after a cancel")
    measures["cancel_to_end_s"] = time.monotonic() - start
    expect(robot.cancelled(identity), (3, 0), "a cancel of a goal that is over")


def check_tf(robot):
    """A goal in a frame that is known through /tf_static alone: a camera that looks to the left."""
    robot.idle()
    half = math.sin(math.pi / 4)
    mount = Transform(translation=Point(0.2, 0.45, 0.0), rotation=Quaternion(0.0, 0.0, half, half))
    header = Header(stamp=Time(), frame_id="base_footprint")
    camera = TransformStamped(header=header, child_frame_id="camera", transform=mount)
    robot.tf_static.write(TFMessage(transforms=[camera]))
    time.sleep(0.3)
    # In the camera's axes the ball lies 0.5 m behind it, and forward is to its right.
    identity, accepted = robot.kick(frame="camera", ball=(-0.5, 0.0, 0.0), yaw=-math.pi / 2, what="a goal through TF")
    expect(accepted, True, "a goal through TF")
    expect(robot.cancelled([0] * 16), (0, 1), "a cancel of everything")
    expect(robot.ended(identity, "a goal through TF"), (STATUS_CANCELED, ABORTED), "a goal through TF")


def check_garbage(robot, domain, seed, packets=4000):
    """Packets of any content to every port of the node; it must go on."""
    rng = random.Random(seed)
    ports = [7400 + 250 * domain + offset for offset in (0, 1, 10, 11)]
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    header = b"RTPS\x02\x03\x01\x12" + bytes(12)
    for i in range(packets):
        if i % 3 == 0:
            packet = rng.randbytes(rng.randrange(600))
        else:
            # Sub-messages of every kind, with lengths that are right or wrong and entities that exist or do not.
            packet = header
            for _ in range(rng.randrange(1, 5)):
                kind = rng.choice([0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D, 0x0E, 0x0F, 0x12, 0x13, 0x15, 0x16, 0x30])
                body = bytearray(rng.randbytes(4 * rng.randrange(24)))
                if rng.random() < 0.7 and len(body) >= 24 and kind in (0x15, 0x16):
                    writer = rng.choice([b"\x00\x01\x00\xc2", b"\x00\x00\x03\xc2", b"\x00\x00\x04\xc2", b"\x00\x00\x02\x03"])
                    body[0:4] = b"\x00\x00\x10\x00"
                    body[4:12] = rng.choice([bytes(4), b"\x00\x01\x00\xc7"]) + writer
                    body[12:20] = (0).to_bytes(4, "little") + rng.randrange(1, 9).to_bytes(4, "little")
                    body[20:24] = rng.choice([b"\x00\x03\x00\x00", b"\x00\x01\x00\x00", b"\x00\x00\x00\x00"])
                length = len(body) if rng.random() < 0.8 else rng.randrange(65536)
                packet += bytes([kind, rng.randrange(16) | 1]) + length.to_bytes(2, "little") + bytes(body)
        try:
            out.sendto(packet, ("127.0.0.1", rng.choice(ports)))
        except OSError:
            pass
        if i % 200 == 0:
            time.sleep(0.005)
    time.sleep(0.5)


def check_alive(robot, what):
    robot.idle()
    identity, accepted = robot.kick(what=what)
    expect(accepted, True, what)
    robot.cancelled(identity)
    expect(robot.ended(identity, what), (STATUS_CANCELED, ABORTED), what)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--mapping", choices=["cyclone", "enhanced"], required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--brief", action="store_true", help="only a goal, a rejection and a cancel")
    arguments = parser.parse_args()
    random.seed()
    measures = {}
    try:
        robot = Robot(arguments.domain, arguments.mapping)
        measures["endpoints"] = check_names(robot)
        check_rejections(robot)
        check_cancel(robot, measures)
        if not arguments.brief:
            check_kick(robot, measures)
            check_tf(robot)
            check_garbage(robot, arguments.domain, arguments.seed)
            check_alive(robot, "a goal after packets of any content")
    except Failed as failed:
        print(failed, file=sys.stderr)
        print(json.dumps(measures), file=sys.stderr)
        os._exit(1)
    print(json.dumps(measures))
    sys.stdout.flush()
    # The library's own end can hang when the peer is gone first.
    os._exit(0)


main()
