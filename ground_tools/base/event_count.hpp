/// How many of some independent events happen: the Poisson-binomial distribution, exactly.
///
/// One event after the other is added (dynamic programming): P(k of n) = P(k of n-1) (1 - p_n) + P(k-1 of
/// n-1) p_n. All terms are positive, so nothing cancels. (Barlow and Heidtmann 1984; Hong 2013, section 2.)
#pragma once

#include <cstddef>
#include <vector>

namespace cairn::ground {

/// P(at least `least` events). Asks for probabilities in [0, 1]. Cost n `least`.
double at_least(const std::vector<double>& probabilities, std::size_t least);

/// P(at most `most` events), with all its digits however small it is. The same cost.
double at_most(const std::vector<double>& probabilities, std::size_t most);

/// P(k events) for each k from none to all. Cost n^2.
std::vector<double> distribution(const std::vector<double>& probabilities);

/// Of each event, the probability that it happened, given that at least `least` did; 0 where that cannot be.
/// Cost n^2 `least`.
std::vector<double> given_at_least(const std::vector<double>& probabilities, std::size_t least);

}  // namespace cairn::ground
