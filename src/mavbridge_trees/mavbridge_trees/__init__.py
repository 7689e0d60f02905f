"""Behaviour trees and plans over the actions of navigation_server; see docs/programs.md."""
