// The shortest path in the plane around obstacles, searched only among those that it meets.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "shapes.hpp"

namespace kernels {

enum class SearchEnd { FOUND = 0, NONE = 1, TOO_MUCH_WORK = 2 };

struct Bounds {
    double clearance_m;
    // No path of this length or more is wanted.
    double longest_m;
    // Of looks at a pair of an obstacle and a line, a point or another obstacle.
    std::int64_t looks_max;
};

// Begins with the straight line. Where the shortest path around the obstacles that were taken in
// hits others, these are taken in, too. A path that hits none is the shortest there is: an obstacle
// that was never taken in could only have made it longer. Outlines are polygons about them.
class TangentSearch {
  public:
    // All shapes count, whatever their heights.
    TangentSearch(Point start, Point goal, const Shapes &every, const Bounds &bounds);

    SearchEnd run();
    const std::vector<Point> &path() const { return path_; }
    std::int64_t looks() const { return looks_; }

  private:
    static constexpr int CORNERS = 16;
    static constexpr int START = 0, GOAL = 1;
    // Within this many clearances, obstacles are close together.
    static constexpr double APART = 1.0;
    // To look at so many pairs of corners is quicker than to look for the lines that touch both.
    static constexpr std::size_t PAIRS_FEW = 24;

    // A point, and the vectors to its neighbours on its polygon; start and goal have none.
    struct Node {
        Point at, before, after;
        bool sound;
        std::vector<int> edges;
    };
    struct Edge {
        int one, other;
        double length_m;
        // How many of the obstacles taken in it is known to be clear of; and of all.
        std::size_t clear_of;
        bool is_clear_of_all, is_closed;
    };

    std::vector<std::size_t> chosen_of(const std::vector<std::size_t> &met);
    void take(std::size_t row);
    void add_polygon(const Shape &shape);
    void join(int polygon, int other);
    int corner_towards(int polygon, Point direction) const;
    static int opposite(int polygon, int corner) {
        return first_of(polygon) + (corner - first_of(polygon) + CORNERS / 2) % CORNERS;
    }
    int touching(Point from, int polygon, int guess, double side) const;
    void join_apart(int polygon, int other);
    void add_if_tangent(int one, int other);
    void add_edge(int one, int other);
    bool passes(const Node &node, Point along) const;
    bool is_open(Edge &edge);
    bool find_shortest();
    bool is_over() const { return looks_ > bounds_.looks_max; }
    static int first_of(int polygon) { return 2 + polygon * CORNERS; }
    Node &node(int number) { return nodes_[static_cast<std::size_t>(number)]; }
    const Node &node(int number) const { return nodes_[static_cast<std::size_t>(number)]; }
    Edge &edge(int number) { return edges_[static_cast<std::size_t>(number)]; }
    Line line_of(const Edge &edge) const;

    const Shapes &every_;
    Bounds bounds_;
    std::int64_t looks_ = 0;
    Shapes taken_;
    std::vector<Node> nodes_;
    std::vector<Edge> edges_;
    // Of each polygon: how far its corners are from its middle at most, and those that are sound.
    std::vector<double> reach_m_;
    std::vector<std::vector<int>> sound_;
    std::vector<int> route_;
    std::vector<Point> path_;
};

}  // namespace kernels
