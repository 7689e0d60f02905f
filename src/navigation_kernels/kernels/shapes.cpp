#include "shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kernels {

namespace {

// A line that rises less than this is level; one that is shorter than the other is a point.
constexpr double LEVEL_M = 1e-9, POINT_M = 1e-9;
constexpr double INFINITE = std::numeric_limits<double>::infinity();
// A line that runs less than this along an axis runs beside it.
constexpr double BESIDE_M = 1e-12;

struct Part {
    double enter, leave;
};

// A value that is not a number stays so, unlike by std::max and std::min.
double at_least(double value, double bound) { return value < bound ? bound : value; }
double at_most(double value, double bound) { return value > bound ? bound : value; }

double within(double value, double low, double high) { return at_most(at_least(value, low), high); }

double outside(Point point, Point half) {
    return length({at_least(std::abs(point.east) - half.east, 0.0),
                   at_least(std::abs(point.north) - half.north, 0.0)});
}

// The share of a line from a point at which it is nearest to another.
double nearest_share(Point offset, Point along) {
    return dot(offset, along) / at_least(dot(along, along), POINT_M * POINT_M);
}

Part in_slab(double start, double line, double half) {
    const double safe = std::abs(line) < BESIDE_M ? BESIDE_M : line;
    const double first = (-half - start) / safe, second = (half - start) / safe;
    return first < second ? Part{first, second} : Part{second, first};
}

// Whether a line goes through a box about the origin.
bool crosses(Point start, Point line, Point half) {
    const Part x = in_slab(start.east, line.east, half.east);
    const Part y = in_slab(start.north, line.north, half.north);
    const double enter = std::max(x.enter, y.enter), leave = std::min(x.leave, y.leave);
    return enter <= leave && leave >= 0.0 && enter <= 1.0;
}

double line_to_box_m(Point start, Point end, Point half) {
    const Point line = end - start;
    if (crosses(start, line, half)) return 0.0;
    // Apart, the nearest two points are an end of the line or a corner of the box.
    double nearest = at_most(outside(start, half), outside(end, half));
    for (double x : {half.east, -half.east})
        for (double y : {half.north, -half.north}) {
            const Point corner = Point{x, y} - start;
            const double share = within(nearest_share(corner, line), 0.0, 1.0);
            nearest = at_most(nearest, length(corner - share * line));
        }
    return nearest;
}

}  // namespace

double length(Point a) { return std::sqrt(dot(a, a)); }

double Shape::gap_m(Point point) const {
    return outside(in_own_axes(point - middle), half) - radius;
}

bool Shape::is_met_by(const Line &line, double clearance_m) const {
    const Point along = line.end - line.start;
    const double begin = line.start_up, rise = line.end_up - begin;
    if (std::isnan(along.east + along.north + rise)) return true;
    const double low = bottom - clearance_m, high = top + clearance_m;
    Part part = {0.0, 1.0};
    if (std::abs(rise) < LEVEL_M) {
        if (!(begin > low && begin < high)) return false;
    } else {
        const double first = (low - begin) / rise, last = (high - begin) / rise;
        part = {at_least(first < last ? first : last, 0.0), at_most(first < last ? last : first, 1.0)};
        if (part.enter >= part.leave) return false;
    }
    if (half.east == 0.0 && half.north == 0.0) {
        const Point offset = middle - line.start;
        const double share = within(nearest_share(offset, along), part.enter, part.leave);
        const double gap_m = length(offset - share * along) - radius;
        return !(at_least(gap_m, 0.0) >= clearance_m);
    }
    const Point start = line.start - middle;
    const Point enter = in_own_axes(start + part.enter * along);
    const Point leave = in_own_axes(start + part.leave * along);
    return !(at_least(line_to_box_m(enter, leave, half) - radius, 0.0) >= clearance_m);
}

Shapes::Shapes(const Tables &tables, Heights heights) {
    const auto count = static_cast<std::size_t>(tables.post_count + tables.box_count);
    all_.reserve(count);
    for (std::vector<double> *column : {&east_, &north_, &reach_}) column->reserve(count);
    for (std::int64_t row = 0; row < tables.post_count; ++row) {
        const double *post = tables.posts + 5 * row;
        add({{post[0], post[1]}, {0.0, 0.0}, 1.0, 0.0, post[2], post[3], post[4]});
    }
    for (std::int64_t row = 0; row < tables.box_count; ++row) {
        const double *box = tables.boxes + 7 * row;
        add({{box[0], box[1]}, {box[2], box[3]}, std::cos(box[4]), std::sin(box[4]), 0.0, box[5],
             box[6]});
    }
    if (heights == Heights::ENDLESS)
        for (Shape &shape : all_) {
            shape.bottom = -INFINITE;
            shape.top = INFINITE;
        }
}

void Shapes::add(const Shape &shape) {
    all_.push_back(shape);
    east_.push_back(shape.middle.east);
    north_.push_back(shape.middle.north);
    reach_.push_back(shape.radius + length(shape.half));
}

bool Shapes::is_clear(const Line &line, double clearance_m, std::size_t first) const {
    bool clear = true;
    each_met(line, clearance_m, first, [&clear](std::size_t) { return clear = false; });
    return clear;
}

bool Shapes::is_clear(Point point, double clearance_m) const {
    for (std::size_t row = 0; row < all_.size(); ++row)
        if (!is_clear_of(row, point, clearance_m)) return false;
    return true;
}

}  // namespace kernels
