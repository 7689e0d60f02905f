#include "tangent_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace kernels {

namespace {

constexpr double PI = 3.14159265358979323846;
// A line along a polygon must not be nearer than the clearance by rounding.
constexpr double ROOM = 1.0 + 1e-6;
// How far a neighbour may be on the wrong side of a line that touches, as an area in square metres.
constexpr double TOUCHING_M2 = 1e-9;

double sign(double value) { return value > 0.0 ? 1.0 : -1.0; }

}  // namespace

TangentSearch::TangentSearch(Point start, Point goal, const Shapes &every, const Bounds &bounds)
    : every_(every), bounds_(bounds), taken_(Tables{}) {
    nodes_.push_back({start, {0.0, 0.0}, {0.0, 0.0}, true, {}});
    nodes_.push_back({goal, {0.0, 0.0}, {0.0, 0.0}, true, {}});
    add_edge(START, GOAL);
}

SearchEnd TangentSearch::run() {
    while (!is_over()) {
        if (!find_shortest()) return is_over() ? SearchEnd::TOO_MUCH_WORK : SearchEnd::NONE;
        std::vector<std::size_t> met;
        for (int number : route_) {
            Edge &edge = this->edge(number);
            if (edge.is_clear_of_all) continue;
            const std::size_t before = met.size();
            looks_ += static_cast<std::int64_t>(every_.size());
            every_.each_met(line_of(edge), bounds_.clearance_m, 0, [&met](std::size_t row) {
                met.push_back(row);
                return true;
            });
            edge.is_clear_of_all = met.size() == before;
        }
        if (met.empty()) return SearchEnd::FOUND;
        for (std::size_t row : chosen_of(met)) {
            if (is_over()) break;
            take(row);
        }
    }
    return SearchEnd::TOO_MUCH_WORK;
}

// Of small obstacles close together, as the cells of a wall, one will do at a time: the next path
// mostly keeps clear of those beside it, too.
std::vector<std::size_t> TangentSearch::chosen_of(const std::vector<std::size_t> &met) {
    const double apart_m = APART * bounds_.clearance_m;
    std::vector<std::size_t> chosen;
    for (std::size_t row : met) {
        const Shape &shape = every_[row];
        const auto is_beside = [&](std::size_t other) {
            const Point between = every_[other].middle - shape.middle;
            const double reach_m = every_.reach_m(row) + every_.reach_m(other);
            return other == row || length(between) + reach_m < apart_m;
        };
        looks_ += static_cast<std::int64_t>(chosen.size());
        if (std::none_of(chosen.begin(), chosen.end(), is_beside)) chosen.push_back(row);
    }
    return chosen;
}

Line TangentSearch::line_of(const Edge &edge) const {
    return {node(edge.one).at, node(edge.other).at, 0.0, 0.0};
}

void TangentSearch::take(std::size_t row) {
    const Shape &shape = every_[row];
    taken_.add(shape);
    const auto is_too_near = [&](int corner) {
        Node &here = node(corner);
        here.sound = taken_.is_clear_of(taken_.size() - 1, here.at, bounds_.clearance_m);
        return !here.sound;
    };
    for (std::vector<int> &corners : sound_) {
        looks_ += static_cast<std::int64_t>(corners.size());
        corners.erase(std::remove_if(corners.begin(), corners.end(), is_too_near), corners.end());
    }
    add_polygon(shape);
    const int polygon = static_cast<int>(sound_.size()) - 1, first = first_of(polygon);
    if (sound_.back().empty()) return;
    for (int corner = 0; corner < CORNERS; ++corner)
        add_if_tangent(first + corner, first + (corner + 1) % CORNERS);
    for (int end : {START, GOAL})
        for (int corner = 0; corner < CORNERS; ++corner) add_if_tangent(end, first + corner);
    for (int other = 0; other < polygon; ++other)
        join(polygon, other);
    looks_ += polygon + 2 * CORNERS;
}

void TangentSearch::add_polygon(const Shape &shape) {
    const double reach = (shape.radius + bounds_.clearance_m) * ROOM / std::cos(PI / CORNERS);
    std::array<Point, CORNERS> corners;
    for (int k = 0; k < CORNERS; ++k) {
        const double angle = 2.0 * PI * (k + 0.5) / CORNERS;
        const double x = sign(std::cos(angle)) * shape.half.east + reach * std::cos(angle);
        const double y = sign(std::sin(angle)) * shape.half.north + reach * std::sin(angle);
        corners[static_cast<std::size_t>(k)] =
            shape.middle +
            Point{x * shape.cosine - y * shape.sine, x * shape.sine + y * shape.cosine};
    }
    reach_m_.push_back(length(shape.half) + reach);
    sound_.emplace_back();
    for (std::size_t k = 0; k < CORNERS; ++k) {
        const Point at = corners[k];
        const bool sound = taken_.is_clear(at, bounds_.clearance_m);
        if (sound) sound_.back().push_back(static_cast<int>(nodes_.size()));
        nodes_.push_back({at, corners[(k + CORNERS - 1) % CORNERS] - at,
                          corners[(k + 1) % CORNERS] - at, sound, {}});
    }
    looks_ += CORNERS * static_cast<std::int64_t>(taken_.size());
}

void TangentSearch::join(int polygon, int other) {
    const auto one = static_cast<std::size_t>(polygon), two = static_cast<std::size_t>(other);
    const std::size_t pairs = sound_[one].size() * sound_[two].size();
    const double reach_m = ROOM * (reach_m_[one] + reach_m_[two]);
    const Point between = taken_[two].middle - taken_[one].middle;
    if (pairs > PAIRS_FEW && dot(between, between) > reach_m * reach_m) {
        join_apart(polygon, other);
        return;
    }
    looks_ += static_cast<std::int64_t>(pairs);
    for (int a : sound_[one])
        for (int b : sound_[two]) add_if_tangent(a, b);
}

// Adds the four lines that touch two polygons which do not overlap.
void TangentSearch::join_apart(int polygon, int other) {
    looks_ += CORNERS;
    const Point between = taken_[static_cast<std::size_t>(other)].middle -
                          taken_[static_cast<std::size_t>(polygon)].middle;
    const Point left = {-between.north, between.east};
    // The left side of the one is the right side as seen from the other.
    const int right = corner_towards(polygon, -1.0 * left), far_left = corner_towards(other, left);
    for (double side : {1.0, -1.0})
        for (double other_side : {1.0, -1.0}) {
            int one = side > 0.0 ? right : opposite(polygon, right);
            int two = other_side > 0.0 ? far_left : opposite(other, far_left);
            for (int round = 0; round < CORNERS; ++round) {
                const int next_two = touching(node(one).at, other, two, other_side);
                const int next_one = touching(node(next_two).at, polygon, one, side);
                const bool stays = next_one == one && next_two == two;
                one = next_one;
                two = next_two;
                if (stays) break;
            }
            add_if_tangent(one, two);
        }
}

// A corner of a polygon that is far into a direction, if not the farthest.
int TangentSearch::corner_towards(int polygon, Point direction) const {
    const Point own = taken_[static_cast<std::size_t>(polygon)].in_own_axes(direction);
    const double turn = std::atan2(own.north, own.east) / (2.0 * PI);
    const int corner = static_cast<int>(CORNERS * (turn + 1.0)) % CORNERS;
    return first_of(polygon) + corner;
}

// The corner of a polygon farthest to one side, as seen from a point outside; of two, the nearer.
int TangentSearch::touching(Point from, int polygon, int guess, double side) const {
    const int first = first_of(polygon);
    int here = guess - first;
    for (int step : {1, CORNERS - 1})
        for (int count = 0; count < CORNERS; ++count) {
            const int next = (here + step) % CORNERS;
            const Point to_here = node(first + here).at - from;
            const Point to_next = node(first + next).at - from;
            const double turn = side * cross(to_here, to_next);
            const bool is_level = std::abs(turn) <= TOUCHING_M2;
            if (is_level ? dot(to_next, to_next) >= dot(to_here, to_here) : turn < 0.0) break;
            here = next;
        }
    return first + here;
}

bool TangentSearch::passes(const Node &node, Point along) const {
    return cross(along, node.before) * cross(along, node.after) >= -TOUCHING_M2;
}

void TangentSearch::add_if_tangent(int one, int other) {
    const Node &a = node(one), &b = node(other);
    const Point along = b.at - a.at;
    if (a.sound && b.sound && passes(a, along) && passes(b, along)) add_edge(one, other);
}

void TangentSearch::add_edge(int one, int other) {
    Node &a = node(one), &b = node(other);
    const double length_m = length(b.at - a.at);
    const int number = static_cast<int>(edges_.size());
    edges_.push_back({one, other, length_m, 0, false, false});
    a.edges.push_back(number);
    b.edges.push_back(number);
}

// Whether a line is clear of all that is taken in; each is looked at once.
bool TangentSearch::is_open(Edge &edge) {
    if (edge.is_closed || edge.is_clear_of_all) return !edge.is_closed;
    const std::size_t count = taken_.size();
    looks_ += static_cast<std::int64_t>(count - edge.clear_of);
    edge.is_closed = !taken_.is_clear(line_of(edge), bounds_.clearance_m, edge.clear_of);
    edge.clear_of = count;
    return !edge.is_closed;
}

bool TangentSearch::find_shortest() {
    struct Reached {
        double bound_m, length_m;
        int node, edge;
        bool operator<(const Reached &other) const { return bound_m > other.bound_m; }
    };
    std::vector<int> by(nodes_.size(), -1);
    std::vector<double> lengths_m(nodes_.size(), std::numeric_limits<double>::infinity());
    std::vector<char> is_final(nodes_.size(), 0);
    std::priority_queue<Reached> queue;
    const Point goal = nodes_[GOAL].at;
    queue.push({length(goal - nodes_[START].at), 0.0, START, -1});
    while (!queue.empty() && !is_over()) {
        const Reached reached = queue.top();
        queue.pop();
        const auto here = static_cast<std::size_t>(reached.node);
        ++looks_;
        if (is_final[here]) continue;
        is_final[here] = true;
        by[here] = reached.edge;
        if (reached.node == GOAL) break;
        std::vector<int> &edges = nodes_[here].edges;
        const auto is_useless = [&](int number) {
            const Edge &line = edge(number);
            return line.is_closed || !node(line.one).sound || !node(line.other).sound;
        };
        edges.erase(std::remove_if(edges.begin(), edges.end(), is_useless), edges.end());
        for (int number : edges) {
            Edge &line = edge(number);
            const int next = line.one == reached.node ? line.other : line.one;
            if (is_final[static_cast<std::size_t>(next)]) continue;
            const double length_m = reached.length_m + line.length_m;
            const double bound_m = length_m + length(goal - node(next).at);
            double &shortest_m = lengths_m[static_cast<std::size_t>(next)];
            // A line is looked at only where it would be on a shorter path.
            if (length_m >= shortest_m || bound_m >= bounds_.longest_m || !is_open(line)) continue;
            shortest_m = length_m;
            queue.push({bound_m, length_m, next, number});
        }
    }
    if (!is_final[GOAL]) return false;
    route_.clear();
    path_.assign(1, goal);
    for (int here = GOAL; here != START;) {
        const int number = by[static_cast<std::size_t>(here)];
        const Edge &line = edge(number);
        here = line.one == here ? line.other : line.one;
        route_.push_back(number);
        path_.push_back(node(here).at);
    }
    std::reverse(path_.begin(), path_.end());
    return true;
}

}  // namespace kernels
