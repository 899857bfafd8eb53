//! The frame pool: buffers come back, an empty pool counts, and nothing large is allocated once it runs.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering, fence};
use std::time::Duration;

use coshade_capture::{Converter, Frame, FramePool, PixelBuffer, PixelFormat, latest};

struct Counting;

thread_local! {
    /// Large allocations of this thread: the test's harness allocates in others.
    static LARGE: AtomicUsize = const { AtomicUsize::new(0) };
}

/// The optimiser believes that allocating changes no memory of ours: without barriers it moves the look elsewhere.
fn large_allocations() -> usize {
    fence(Ordering::SeqCst);
    let count = LARGE.with(|large| black_box(large).load(Ordering::SeqCst));
    fence(Ordering::SeqCst);
    count
}
const LARGE_BYTES: usize = 4096;

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGE.with(|large| large.fetch_add(usize::from(layout.size() >= LARGE_BYTES), Ordering::SeqCst));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn buffers_come_back_and_nothing_large_is_allocated_in_the_steady_state() {
    let before = large_allocations();
    drop(black_box(PixelBuffer::from_vec(black_box(vec![0; LARGE_BYTES]))));
    assert_eq!(large_allocations(), before + 1, "the allocator must be counted");

    let (width, height) = (320_u32, 240_u32);
    let pool = FramePool::new(4, (width * height * 3) as usize);
    let mut converter = Converter::new();
    let (sender, mut receiver) = latest();
    let mut numbers = vec![0.0_f32; (width * height * 3) as usize];
    let mut after_warm_up = 0;
    for n in 0..20_u8 {
        if n == 2 {
            after_warm_up = large_allocations();
        }
        let mut pixels = pool.acquire((width * height * 2) as usize).unwrap();
        pixels.fill(n);
        let frame = Frame::packed(PixelFormat::Yuyv, width, height, pixels.freeze()).unwrap();
        let rgb = converter.rgb24_frame(&frame, &pool).unwrap().unwrap();
        let grey = converter.grey_frame(&frame, &pool).unwrap().unwrap();
        converter.rgb_f32(&frame, &mut numbers).unwrap();
        sender.send((frame.clone(), rgb)).unwrap();
        let (received, _rgb) = receiver.receive(Duration::ZERO).unwrap();
        assert!(received.pixels.iter().chain(grey.pixels.iter()).all(|byte| *byte == n));
        assert_eq!(pool.available(), 1);
    }
    assert_eq!(large_allocations(), after_warm_up);
    assert_eq!((pool.available(), pool.dropped()), (4, 0));

    // Sharing keeps a buffer out; an unfilled one comes back too; an empty pool refuses and counts.
    let shared = pool.acquire(1).unwrap().freeze();
    let clone = shared.clone();
    let others: Vec<_> = (0..3).map(|_| pool.acquire(10).unwrap()).collect();
    assert!(pool.acquire(1).is_none() && pool.acquire(1).is_none());
    assert_eq!(pool.dropped(), 2);
    drop(shared);
    assert_eq!(pool.available(), 0);
    drop(clone);
    assert_eq!(pool.available(), 1);
    drop(others);
    assert_eq!(pool.available(), 4);

    // A buffer grows to what is asked for and shrinks to what was filled.
    let mut large = pool.acquire(1_000_000).unwrap();
    assert_eq!(large.len(), 1_000_000);
    large.truncate(10);
    large.truncate(20);
    assert_eq!(large.freeze().len(), 10);
}
