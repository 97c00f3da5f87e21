//! Disjoint sets whose members know their sign relative to the set.

/// Sets of members with signs.
pub(crate) struct SignedSets {
    parent: Vec<u32>,
    size: Vec<u32>,
    /// Whether the sign differs from the parent's.
    opposite: Vec<bool>,
}

impl SignedSets {
    /// A set for each member.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
            size: vec![1; count],
            opposite: vec![false; count],
        }
    }

    /// The root of a member's set and whether its sign differs from the root's.
    pub(crate) fn find(&mut self, member: u32) -> (u32, bool) {
        let (mut root, mut sign) = (member, false);
        while self.parent[root as usize] != root {
            sign ^= self.opposite[root as usize];
            root = self.parent[root as usize];
        }
        // Every member on the way now hangs directly on the root.
        let (mut here, mut rest) = (member, sign);
        while self.parent[here as usize] != root {
            let next = self.parent[here as usize];
            let step = std::mem::replace(&mut self.opposite[here as usize], rest);
            self.parent[here as usize] = root;
            rest ^= step;
            here = next;
        }
        (root, sign)
    }

    /// Makes one set of two, unless it would have more than `most` members; `opposite` tells whether
    /// the members' signs differ.
    pub(crate) fn join(&mut self, a: u32, b: u32, opposite: bool, most: u32) {
        let ((root_a, sign_a), (root_b, sign_b)) = (self.find(a), self.find(b));
        let size = self.size[root_a as usize] + self.size[root_b as usize];
        if root_a == root_b || size > most {
            return;
        }
        let a_is_larger = self.size[root_a as usize] >= self.size[root_b as usize];
        let (low, high) = if a_is_larger { (root_b, root_a) } else { (root_a, root_b) };
        self.parent[low as usize] = high;
        self.size[high as usize] = size;
        self.opposite[low as usize] = sign_a ^ sign_b ^ opposite;
    }

    /// For each member the number of its set, in the order of first members, and whether its sign
    /// differs from the set's; and the number of sets.
    pub(crate) fn numbered(mut self) -> (Vec<(u32, bool)>, usize) {
        let mut number = vec![u32::MAX; self.parent.len()];
        let mut count = 0;
        let members = (0..self.parent.len() as u32)
            .map(|member| {
                let (root, opposite) = self.find(member);
                let number = &mut number[root as usize];
                if *number == u32::MAX {
                    *number = count;
                    count += 1;
                }
                (*number, opposite)
            })
            .collect();
        (members, count as usize)
    }
}
