"""Messages as a camera's driver sends them, and what comes back."""
import queue

import geometry_msgs.msg
import numpy as np
import rospy
import sensor_msgs.msg
import tf2_msgs.msg

import ros_world
from holdfast_msgs.msg import PatchArray


def stamp(seconds):
    return rospy.Time.from_sec(seconds)


def cloud(points, seconds, frame="camera"):
    message = sensor_msgs.msg.PointCloud2()
    message.header.stamp = stamp(seconds)
    message.header.frame_id = frame
    message.height, message.width = points.shape[:2]
    message.fields = [
        sensor_msgs.msg.PointField(name, 4 * i, sensor_msgs.msg.PointField.FLOAT32, 1)
        for i, name in enumerate("xyz")]
    message.point_step, message.row_step = 12, 12 * message.width
    message.data = points.astype("<f4").tobytes()
    return message


def transform(parent, child, seconds, pose):
    """pose: x y z qx qy qz qw."""
    message = geometry_msgs.msg.TransformStamped()
    message.header.stamp = stamp(seconds)
    message.header.frame_id = parent
    message.child_frame_id = child
    message.transform.translation = geometry_msgs.msg.Vector3(*pose[:3])
    message.transform.rotation = geometry_msgs.msg.Quaternion(*pose[3:])
    return tf2_msgs.msg.TFMessage([message])


CLOUD = {"cloud": sensor_msgs.msg.PointCloud2}
PATCHES = {"patches": PatchArray}
TF = {"/tf": tf2_msgs.msg.TFMessage}


class Link:
    """A node of ours with all its topics connected to this process."""

    def __init__(self, world, name, *arguments, inputs=CLOUD, outputs=PATCHES):
        def full(topic):
            return topic if topic.startswith("/") else f"/{name}/{topic}"

        remapped = [f"{topic}:={full(topic)}" for topic in inputs
                    if not topic.startswith("/")]
        self.name = name
        # What is done in a time depends on the machine and on what else it does.
        self.node = world.start(name, *remapped, "_budget_ms:=0", *arguments)
        self.publishers = {topic: rospy.Publisher(full(topic), kind, queue_size=1000)
                           for topic, kind in inputs.items()}
        self.answers = {topic: queue.Queue() for topic in outputs}
        self.subscribers = [
            rospy.Subscriber(full(topic), kind, self.answers[topic].put)
            for topic, kind in outputs.items()]
        ros_world.wait_until(self.is_connected, f"connection to {name}")

    def is_connected(self):
        assert self.node.is_alive(), self.node.text()
        ends = [*self.publishers.values(), *self.subscribers]
        return all(end.get_num_connections() > 0 for end in ends)

    def send(self, topic, message):
        self.publishers[topic].publish(message)

    def get(self, topic="patches"):
        try:
            return self.answers[topic].get(timeout=ros_world.LIMIT_S)
        except queue.Empty:
            raise AssertionError(f"no {topic}:\n{self.node.text()}") from None

    def ask(self, message, topic="cloud"):
        self.send(topic, message)
        return self.get()

    def ask_until_good(self, message, topic="cloud"):
        def good():
            answer = self.ask(message, topic)
            return None if answer.problem else answer

        return ros_world.wait_until(good, "answer without a problem")

    def close(self):
        """Stops the node, which must have gone well."""
        code = self.node.stop()
        for end in [*self.publishers.values(), *self.subscribers]:
            end.unregister()
        assert code == 0, f"{code}: {self.node.text()}"


def symmetric(numbers):
    """A covariance as a square."""
    size = int(round(len(numbers) ** 0.5))
    matrix = np.array(numbers).reshape(size, size)
    # Sums that are the same but for their order.
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9)
    return matrix
