// Normals by jet fitting of CGAL, for peers.py.
//
//     g++ -O3 -march=native -DCGAL_EIGEN3_ENABLED -I/usr/include/eigen3 jets.cpp -lgmp -o jets
//     jets NEIGHBOURS < POINTS > NORMALS      three floats a point

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/property_map.h>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Pair = std::pair<Kernel::Point_3, Kernel::Vector_3>;

int main(int count, char** words) {
    if (count != 2) return 2;
    std::vector<Pair> pairs;
    float row[3];
    while (std::fread(row, sizeof(float), 3, stdin) == 3)
        pairs.emplace_back(Kernel::Point_3(row[0], row[1], row[2]), Kernel::Vector_3(0, 0, 1));
    const auto maps = CGAL::parameters::point_map(CGAL::First_of_pair_property_map<Pair>())
                          .normal_map(CGAL::Second_of_pair_property_map<Pair>());
    CGAL::jet_estimate_normals<CGAL::Sequential_tag>(pairs, std::atoi(words[1]), maps);
    for (const Pair& pair : pairs) {
        const Kernel::Vector_3& normal = pair.second;
        const float found[3] = {float(normal.x()), float(normal.y()), float(normal.z())};
        if (std::fwrite(found, sizeof(float), 3, stdout) != 3) return 1;
    }
    return 0;
}
