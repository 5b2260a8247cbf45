import Layer from "ol/layer/Layer";
import type { FrameState } from "ol/Map";
import type { Frame } from "../map/document";
import { type Affine, compose, pixelsToMap } from "../map/geometry";

export interface GridPicture {
  readonly image: CanvasImageSource;
  readonly frame: Frame;
}

/** Draws the occupancy picture where its frame says, the yaw of its origin included, which OpenLayers' own image sources can't. */
export class GridLayer extends Layer {
  /** Around the canvas, or else the layers above would draw on it, too. */
  private readonly frame = document.createElement("div");
  private readonly canvas = document.createElement("canvas");
  private picture: GridPicture | null = null;
  /** What is on the canvas: it is drawn again only when that would be something else, not for each frame of the layers above. */
  private drawn = "";
  private pictures = 0;

  constructor() {
    super({});
    for (const { style } of [this.frame, this.canvas]) {
      style.position = "absolute";
      style.inset = "0";
      style.width = "100%";
      style.height = "100%";
    }
    this.frame.append(this.canvas);
  }

  show(picture: GridPicture | null): void {
    this.picture = picture;
    this.pictures++;
    this.changed();
  }

  override render(frameState: FrameState | null): HTMLElement {
    const context = this.canvas.getContext("2d");
    if (!frameState || !context) return this.frame;
    const { pixelRatio, size, viewState } = frameState;
    const wanted = [this.pictures, pixelRatio, ...size, viewState.resolution, ...viewState.center].join();
    if (wanted === this.drawn) return this.frame;
    this.drawn = wanted;
    this.canvas.width = Math.round((size[0] ?? 0) * pixelRatio);
    this.canvas.height = Math.round((size[1] ?? 0) * pixelRatio);
    if (!this.picture) return this.frame;
    const { image, frame } = this.picture;
    const scale = pixelRatio / viewState.resolution;
    const [x = 0, y = 0] = viewState.center;
    const toScreen: Affine = [
      scale,
      0,
      0,
      -scale,
      this.canvas.width / 2 - x * scale,
      this.canvas.height / 2 + y * scale,
    ];
    // Cells stay square when they are larger than a pixel; smaller ones are averaged, or thin walls would drop out.
    context.imageSmoothingEnabled = scale * frame.resolution < 1;
    context.imageSmoothingQuality = "high";
    context.setTransform(...compose(toScreen, pixelsToMap(frame)));
    context.drawImage(image, 0, 0, frame.width, frame.height);
    context.resetTransform();
    return this.frame;
  }
}
