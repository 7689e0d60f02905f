// The functions that Python calls, through ctypes; navigation_kernels/__init__.py documents them.
//
// No function keeps anything, so threads may call them at once. Arrays are rows in C order, of
// doubles unless said otherwise; coordinates are those of the map frame in metres.

#include <cmath>
#include <cstdint>
#include <new>

#include "tangent_search.hpp"

using namespace kernels;

namespace {

constexpr int OUT_OF_MEMORY = -1;

Line line_at(const double *starts, const double *ends, std::int64_t row) {
    const double *a = starts + 3 * row, *b = ends + 3 * row;
    return {{a[0], a[1]}, {b[0], b[1]}, a[2], b[2]};
}

}  // namespace

extern "C" {

// Writes 1 for each of `count` lines that keeps a clearance to all obstacles, else 0.
int navigation_kernels_are_clear(const double *posts, std::int64_t post_count, const double *boxes,
                                 std::int64_t box_count, const double *starts, const double *ends,
                                 std::int64_t count, double clearance_m, std::uint8_t *clear) {
    try {
        const Shapes shapes({posts, post_count, boxes, box_count});
        for (std::int64_t row = 0; row < count; ++row)
            clear[row] = shapes.is_clear(line_at(starts, ends, row), clearance_m);
        return 0;
    } catch (const std::bad_alloc &) {
        return OUT_OF_MEMORY;
    }
}

// Writes the rows of lines and of the obstacles that they meet, as far as there is capacity, and
// returns how many there are.
std::int64_t navigation_kernels_hits(const double *posts, std::int64_t post_count,
                                     const double *boxes, std::int64_t box_count,
                                     const double *starts, const double *ends, std::int64_t count,
                                     double clearance_m, std::int64_t *lines,
                                     std::int64_t *obstacles, std::int64_t capacity) {
    try {
        const Shapes shapes({posts, post_count, boxes, box_count});
        std::int64_t found = 0;
        for (std::int64_t row = 0; row < count; ++row)
            shapes.each_met(line_at(starts, ends, row), clearance_m, 0, [&](std::size_t obstacle) {
                if (found < capacity) {
                    lines[found] = row;
                    obstacles[found] = static_cast<std::int64_t>(obstacle);
                }
                ++found;
                return true;
            });
        return found;
    } catch (const std::bad_alloc &) {
        return OUT_OF_MEMORY;
    }
}

// Writes the points (K, 2) of the shortest path in the plane, as far as there is capacity, and
// their number. Returns a SearchEnd.
int navigation_kernels_tangent_path(const double *posts, std::int64_t post_count,
                                    const double *boxes, std::int64_t box_count,
                                    const double *start, const double *goal, double clearance_m,
                                    double longest_m, std::int64_t looks_max, double *points,
                                    std::int64_t capacity, std::int64_t *count,
                                    std::int64_t *looks) {
    try {
        const Shapes shapes({posts, post_count, boxes, box_count}, Heights::ENDLESS);
        TangentSearch search({start[0], start[1]}, {goal[0], goal[1]}, shapes,
                             {clearance_m, longest_m, looks_max});
        const SearchEnd answer = search.run();
        *looks = search.looks();
        *count = answer == SearchEnd::FOUND ? static_cast<std::int64_t>(search.path().size()) : 0;
        for (std::int64_t row = 0; row < *count && row < capacity; ++row) {
            const Point point = search.path()[static_cast<std::size_t>(row)];
            points[2 * row] = point.east;
            points[2 * row + 1] = point.north;
        }
        return static_cast<int>(answer);
    } catch (const std::bad_alloc &) {
        return OUT_OF_MEMORY;
    }
}

}  // extern "C"
