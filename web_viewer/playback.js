// Which frame is shown, and how it changes with time.
export class Playback {
  constructor(first, last, frameRate) {
    Object.assign(this, { first, last, frameRate, frame: first, playing: false, speed: 1, onChange: () => {} });
    this.passed = 0; // frames since the one that is shown, below 1
  }

  seek(frame) {
    this.passed = 0;
    this.frame = Math.min(Math.max(Math.round(frame), this.first), this.last);
    this.onChange();
  }

  toggle() {
    this.playing = !this.playing && this.last > this.first;
    this.passed = 0;
    this.onChange();
  }

  // Moves on by some seconds; after the last frame comes the first.
  advance(seconds) {
    if (!this.playing) return;
    this.passed += seconds * this.frameRate * this.speed;
    const steps = Math.floor(this.passed);
    if (!steps) return;
    this.passed -= steps;
    this.frame = this.first + ((this.frame - this.first + steps) % (this.last - this.first + 1));
    this.onChange();
  }
}
