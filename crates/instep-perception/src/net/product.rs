//! Matrix products for convolutions: few rows, many columns, where packing the factors costs as much as the product.
//!
//! A general product copies its factors into panels first; with 16 to 64 output channels that took more time than the
//! product itself (40 % against 24 % of a training's). Here rows are contiguous already and are read in place. Tiles are held
//! in registers; each function is compiled for AVX-512, AVX2 and the base processor, and the best that is there is used.

/// Where a matrix lies in a slice: its beginning, and the distances between neighbours in a column and in a row.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) values: &'a [f32],
    pub(super) offset: usize,
    pub(super) row: usize,
    pub(super) column: usize,
}

/// Where the product goes, its rows contiguous.
pub(super) struct Target<'a> {
    pub(super) values: &'a mut [f32],
    pub(super) offset: usize,
    pub(super) row: usize,
}

const WIDE: usize = 32;
const DEEP: usize = 16;

/// The rows of `c += a b` in whole tiles, by AVX-512; the columns that are left over are not touched.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn whole_tiles([m, k, n]: [usize; 3], a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
    for from in (0..n / WIDE * WIDE).step_by(WIDE) {
        let mut i = 0;
        while i + 8 <= m {
            tile_512::<8>(i, from, k, a, b, c);
            i += 8;
        }
        while i + 2 <= m {
            tile_512::<2>(i, from, k, a, b, c);
            i += 2;
        }
        if i < m {
            tile_512::<1>(i, from, k, a, b, c);
        }
    }
}

/// `c += a b`: a of m x k with any strides, b of k x n with contiguous rows.
pub(super) fn add_product(sizes: [usize; 3], a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("fma") {
        // SAFETY: the processor has what the function is compiled for.
        unsafe { whole_tiles(sizes, a, b, c) };
        let [m, k, n] = sizes;
        let done = n / WIDE * WIDE;
        if done < n {
            let rest = View { offset: b.offset + done, ..b };
            let mut to = Target { values: c.values, offset: c.offset + done, row: c.row };
            add_portably([m, k, n - done], a, rest, &mut to);
        }
        return;
    }
    add_portably(sizes, a, b, c);
}

macro_rules! for_the_processor {
    ($name:ident, $body:ident) => {
        pub(super) fn $name(sizes: [usize; 3], a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx2,fma")]
                fn widest(sizes: [usize; 3], a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
                    $body::<true, true>(sizes, a, b, c);
                }
                #[target_feature(enable = "avx2,fma")]
                fn wide(sizes: [usize; 3], a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
                    $body::<true, false>(sizes, a, b, c);
                }
                if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("fma") {
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { widest(sizes, a, b, c) };
                }
                if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { wide(sizes, a, b, c) };
                }
            }
            $body::<false, false>(sizes, a, b, c);
        }
    };
}

for_the_processor!(add_portably, rows_times_rows);
for_the_processor!(add_product_transposed, rows_dot_rows);

#[inline(always)]
fn fma<const FMA: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// `c += a b`: a of m x k with any strides, b of k x n with contiguous rows.
#[inline(always)]
fn rows_times_rows<const FMA: bool, const WIDEST: bool>(
    [m, k, n]: [usize; 3],
    a: View<'_>,
    b: View<'_>,
    c: &mut Target<'_>,
) {
    for from in (0..n).step_by(WIDE) {
        let width = WIDE.min(n - from);
        let mut i = 0;
        while i + 8 <= m {
            tile::<8, FMA>(i, from, width, k, a, b, c);
            i += 8;
        }
        while i + 2 <= m {
            tile::<2, FMA>(i, from, width, k, a, b, c);
            i += 2;
        }
        if i < m {
            tile::<1, FMA>(i, from, width, k, a, b, c);
        }
    }
}

/// As [`tile`] for a whole tile, its sums in named registers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn tile_512<const R: usize>(i: usize, from: usize, k: usize, a: View<'_>, b: View<'_>, c: &mut Target<'_>) {
    use std::arch::x86_64::{
        __m512, _mm512_add_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_storeu_ps,
    };
    assert!(
        k > 0 && a.offset + (i + R - 1) * a.row + (k - 1) * a.column < a.values.len(),
        "left factor inside its slice"
    );
    assert!(b.offset + (k - 1) * b.row + from + WIDE <= b.values.len(), "right factor inside its slice");
    assert!(c.offset + (i + R - 1) * c.row + from + WIDE <= c.values.len(), "product inside its slice");
    let mut low: [__m512; R] = [_mm512_setzero_ps(); R];
    let mut high: [__m512; R] = [_mm512_setzero_ps(); R];
    // SAFETY: the largest index into each slice was just compared with its length.
    unsafe {
        let left = a.values.as_ptr().add(a.offset + i * a.row);
        let mut right = b.values.as_ptr().add(b.offset + from);
        for l in 0..k {
            let (x, y) = (_mm512_loadu_ps(right), _mm512_loadu_ps(right.add(16)));
            for r in 0..R {
                let factor = _mm512_set1_ps(*left.add(r * a.row + l * a.column));
                low[r] = _mm512_fmadd_ps(factor, x, low[r]);
                high[r] = _mm512_fmadd_ps(factor, y, high[r]);
            }
            right = right.wrapping_add(b.row);
        }
        let to = c.values.as_mut_ptr().add(c.offset + i * c.row + from);
        for r in 0..R {
            let to = to.add(r * c.row);
            _mm512_storeu_ps(to, _mm512_add_ps(_mm512_loadu_ps(to), low[r]));
            _mm512_storeu_ps(to.add(16), _mm512_add_ps(_mm512_loadu_ps(to.add(16)), high[r]));
        }
    }
}

#[inline(always)]
fn tile<const R: usize, const FMA: bool>(
    i: usize,
    from: usize,
    width: usize,
    k: usize,
    a: View<'_>,
    b: View<'_>,
    c: &mut Target<'_>,
) {
    let mut sums = [[0.0f32; WIDE]; R];
    let mut padded = [0.0f32; WIDE];
    let factors: [usize; R] = std::array::from_fn(|r| a.offset + (i + r) * a.row);
    for l in 0..k {
        let start = b.offset + l * b.row + from;
        let line = match b.values[start..].first_chunk::<WIDE>() {
            Some(line) if width == WIDE => *line,
            _ => {
                padded[..width].copy_from_slice(&b.values[start..start + width]);
                padded
            }
        };
        let factor: [f32; R] = factors.map(|at| a.values[at + l * a.column]);
        for d in 0..WIDE {
            for r in 0..R {
                sums[r][d] = fma::<FMA>(factor[r], line[d], sums[r][d]);
            }
        }
    }
    for (r, sums) in sums.iter().enumerate() {
        let start = c.offset + (i + r) * c.row + from;
        for (to, s) in c.values[start..start + width].iter_mut().zip(sums) {
            *to += s;
        }
    }
}

/// `c += a bT`: a of m x k and b of n x k, both with contiguous rows; `b.row` is between its rows. Two rows of a against
/// four of b at a time, each product's sum in sixteen parts.
#[inline(always)]
fn rows_dot_rows<const FMA: bool, const WIDEST: bool>(
    [m, k, n]: [usize; 3],
    a: View<'_>,
    b: View<'_>,
    c: &mut Target<'_>,
) {
    let row = |v: View<'_>, i: usize, most: usize| {
        let start = v.offset + i.min(most - 1) * v.row;
        start..start + k
    };
    for j in (0..n).step_by(4) {
        let y = [0, 1, 2, 3].map(|s| &b.values[row(b, j + s, n)]);
        for i in (0..m).step_by(2) {
            let x = [0, 1].map(|r| &a.values[row(a, i + r, m)]);
            #[cfg(target_arch = "x86_64")]
            let sums = if WIDEST {
                // SAFETY: only the function compiled for AVX-512 asks for it.
                unsafe { dots_512(x, y) }
            } else {
                dots::<FMA>(x, y)
            };
            #[cfg(not(target_arch = "x86_64"))]
            let sums = dots::<FMA>(x, y);
            for (r, sums) in sums.iter().enumerate().take(m - i) {
                let start = c.offset + (i + r) * c.row + j;
                for (to, s) in c.values[start..].iter_mut().zip(sums).take(n - j) {
                    *to += s;
                }
            }
        }
    }
}

/// As [`dots`], its sums in registers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn dots_512(x: [&[f32]; 2], y: [&[f32]; 4]) -> [[f32; 4]; 2] {
    use std::arch::x86_64::{_mm512_fmadd_ps, _mm512_loadu_ps, _mm512_reduce_add_ps, _mm512_setzero_ps};
    let k = x[0].len();
    assert!(x.iter().chain(&y).all(|row| row.len() == k), "rows of one length");
    let mut sums = [[_mm512_setzero_ps(); 4]; 2];
    for at in (0..k / DEEP * DEEP).step_by(DEEP) {
        // SAFETY: at + 16 <= k, the length of every row.
        unsafe {
            let left = [_mm512_loadu_ps(x[0].as_ptr().add(at)), _mm512_loadu_ps(x[1].as_ptr().add(at))];
            for s in 0..4 {
                let right = _mm512_loadu_ps(y[s].as_ptr().add(at));
                sums[0][s] = _mm512_fmadd_ps(left[0], right, sums[0][s]);
                sums[1][s] = _mm512_fmadd_ps(left[1], right, sums[1][s]);
            }
        }
    }
    let rest = k / DEEP * DEEP;
    std::array::from_fn(|r| {
        std::array::from_fn(|s| {
            let tail: f32 = x[r][rest..].iter().zip(&y[s][rest..]).map(|(a, b)| a * b).sum();
            _mm512_reduce_add_ps(sums[r][s]) + tail
        })
    })
}

#[inline(always)]
fn dots<const FMA: bool>([x0, x1]: [&[f32]; 2], [y0, y1, y2, y3]: [&[f32]; 4]) -> [[f32; 4]; 2] {
    let ((x0, p0), (x1, p1)) = (x0.as_chunks::<DEEP>(), x1.as_chunks::<DEEP>());
    let ((y0, q0), (y1, q1)) = (y0.as_chunks::<DEEP>(), y1.as_chunks::<DEEP>());
    let ((y2, q2), (y3, q3)) = (y2.as_chunks::<DEEP>(), y3.as_chunks::<DEEP>());
    let zero = [0.0f32; DEEP];
    let (mut a0, mut a1, mut a2, mut a3) = (zero, zero, zero, zero);
    let (mut b0, mut b1, mut b2, mut b3) = (zero, zero, zero, zero);
    for ((((x0, x1), (y0, y1)), y2), y3) in x0.iter().zip(x1).zip(y0.iter().zip(y1)).zip(y2).zip(y3) {
        for d in 0..DEEP {
            a0[d] = fma::<FMA>(x0[d], y0[d], a0[d]);
            a1[d] = fma::<FMA>(x0[d], y1[d], a1[d]);
            a2[d] = fma::<FMA>(x0[d], y2[d], a2[d]);
            a3[d] = fma::<FMA>(x0[d], y3[d], a3[d]);
            b0[d] = fma::<FMA>(x1[d], y0[d], b0[d]);
            b1[d] = fma::<FMA>(x1[d], y1[d], b1[d]);
            b2[d] = fma::<FMA>(x1[d], y2[d], b2[d]);
            b3[d] = fma::<FMA>(x1[d], y3[d], b3[d]);
        }
    }
    let sum =
        |v: [f32; DEEP], p: &[f32], q: &[f32]| v.iter().sum::<f32>() + p.iter().zip(q).map(|(p, q)| p * q).sum::<f32>();
    [
        [sum(a0, p0, q0), sum(a1, p0, q1), sum(a2, p0, q2), sum(a3, p0, q3)],
        [sum(b0, p1, q0), sum(b1, p1, q1), sum(b2, p1, q2), sum(b3, p1, q3)],
    ]
}
