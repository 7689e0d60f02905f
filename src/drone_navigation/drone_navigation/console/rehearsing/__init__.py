"""Goals and routes rehearsed before they are sent, of one vehicle or several. No ROS."""
