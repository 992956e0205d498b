"""Messages as a camera's driver sends them, and what comes back."""
import queue

import geometry_msgs.msg
import numpy as np
import rospy
import sensor_msgs.msg
import tf2_msgs.msg

import ros_world


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


class Link:
    """A node of ours with all its topics connected to this process."""

    def __init__(self, world, name, *arguments, inputs=None, outputs=None):
        self.node = world.start(name, *[f"{old}:=/{name}/{old}" for old in (inputs or {})],
                                *arguments)
        self.publishers = {
            topic: rospy.Publisher(f"/{name}/{topic}", kind, queue_size=1000)
            for topic, kind in (inputs or {}).items()}
        self.answers = {topic: queue.Queue() for topic in (outputs or {})}
        self.subscribers = [
            rospy.Subscriber(f"/{name}/{topic}", kind, self.answers[topic].put)
            for topic, kind in (outputs or {}).items()]
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

    def close(self):
        """Stops the node, which must have gone well."""
        code = self.node.stop()
        for end in [*self.publishers.values(), *self.subscribers]:
            end.unregister()
        assert code == 0, self.node.text()


def symmetric(numbers):
    """A covariance as a square."""
    size = int(round(len(numbers) ** 0.5))
    matrix = np.array(numbers).reshape(size, size)
    np.testing.assert_array_equal(matrix, matrix.T)
    return matrix
