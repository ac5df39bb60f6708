"""A node of ROS 2 around the scene graph memory."""
