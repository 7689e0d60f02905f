// Obstacles as columns, and the straight lines that come near them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kernels {

struct Point {
    double east, north;
};

inline Point operator+(Point a, Point b) { return {a.east + b.east, a.north + b.north}; }
inline Point operator-(Point a, Point b) { return {a.east - b.east, a.north - b.north}; }
inline Point operator*(double k, Point a) { return {k * a.east, k * a.north}; }
inline double cross(Point a, Point b) { return a.east * b.north - a.north * b.east; }
inline double dot(Point a, Point b) { return a.east * b.east + a.north * b.north; }
double length(Point a);

// A straight line in the map frame, metres.
struct Line {
    Point start, end;
    double start_up, end_up;
};

// The tables of navigation_core.mapping.obstacles, not owned: posts (P, 5) are east, north, radius,
// bottom, top; boxes (B, 7) are east, north, half the length, half the width, yaw, bottom, top.
struct Tables {
    const double *posts;
    std::int64_t post_count;
    const double *boxes;
    std::int64_t box_count;
};

// A prism seen from above: a box with a radius about it. A post has no sides, a box no radius.
struct Shape {
    Point middle, half;
    double cosine, sine, radius, bottom, top;

    Point in_own_axes(Point vector) const {
        return {vector.east * cosine + vector.north * sine,
                vector.north * cosine - vector.east * sine};
    }
    // Distance of a point to the outline in the plane, at most 0 within it.
    double gap_m(Point point) const;
    // Whether a line comes nearer than a clearance. With not a number, it does.
    bool is_met_by(const Line &line, double clearance_m) const;
};

enum class Heights { AS_GIVEN, ENDLESS };

// Shapes, with the columns that part most of them from a line quickly.
class Shapes {
  public:
    explicit Shapes(const Tables &tables, Heights heights = Heights::AS_GIVEN);

    std::size_t size() const { return all_.size(); }
    const Shape &operator[](std::size_t row) const { return all_[row]; }
    // How far an outline is from its middle at most.
    double reach_m(std::size_t row) const { return reach_[row]; }
    void add(const Shape &shape);

    // Calls visit(row) for each shape from `first` on that a line meets, until it returns false.
    template <typename Visit>
    void each_met(const Line &line, double clearance_m, std::size_t first, Visit visit) const {
        const Point span = 0.5 * (line.end - line.start), middle = line.start + span;
        const double half = length(span), scale = 1.0 / (half > ROUNDING_M ? half : ROUNDING_M);
        const Point along = scale * span;
        const double room = clearance_m + ROUNDING_M;
        for (std::size_t row = first; row < all_.size(); ++row) {
            const double reach = reach_[row] + room;
            const Point offset = {east_[row] - middle.east, north_[row] - middle.north};
            const double aside = cross(along, offset), ahead = dot(along, offset);
            // Not what is nearer, rather what is not farther: with not a number nothing is clear.
            if (aside > reach || -aside > reach || ahead > half + reach || -ahead > half + reach)
                continue;
            if (half <= ROUNDING_M && dot(offset, offset) > (half + reach) * (half + reach))
                continue;
            if (all_[row].is_met_by(line, clearance_m) && !visit(row)) return;
        }
    }

    bool is_clear(const Line &line, double clearance_m, std::size_t first = 0) const;
    bool is_clear(Point point, double clearance_m) const;
    // The same beside one of them alone.
    bool is_clear_of(std::size_t row, Point point, double clearance_m) const {
        const Point offset = {east_[row] - point.east, north_[row] - point.north};
        const double reach = reach_[row] + clearance_m + ROUNDING_M;
        return dot(offset, offset) > reach * reach || all_[row].gap_m(point) >= clearance_m;
    }

    static constexpr double ROUNDING_M = 1e-6;

  private:
    std::vector<Shape> all_;
    std::vector<double> east_, north_, reach_;
};

}  // namespace kernels
