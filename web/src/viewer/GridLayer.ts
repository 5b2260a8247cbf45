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
  private readonly canvas = document.createElement("canvas");
  private picture: GridPicture | null = null;

  constructor() {
    super({});
    this.canvas.style.position = "absolute";
    this.canvas.style.inset = "0";
    this.canvas.style.width = "100%";
    this.canvas.style.height = "100%";
  }

  show(picture: GridPicture | null): void {
    this.picture = picture;
    this.changed();
  }

  override render(frameState: FrameState | null): HTMLElement {
    const context = this.canvas.getContext("2d");
    if (!frameState || !context) return this.canvas;
    const { pixelRatio, size, viewState } = frameState;
    this.canvas.width = Math.round((size[0] ?? 0) * pixelRatio);
    this.canvas.height = Math.round((size[1] ?? 0) * pixelRatio);
    if (!this.picture) return this.canvas;
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
    context.resetTransform(); // layers above draw on the same canvas
    return this.canvas;
  }
}
