(** Bounds in seconds: times at which formulas surely hold, and sets of times as spans between cuts. *)

Require Import Reals Lra Lia List Bool Arith ZArith.
Import ListNotations.
Open Scope R_scope.

(** ** Meaning

    [until_at a b P Q t]: from t on P is so until Q is, between a and b seconds later.  Regions are
    closed: what holds outside of one begins just after an instant, so that Q may be so just after. *)

Definition upto (b : option R) (d : R) : Prop := match b with Some b => d <= b | None => True end.
Definition below (b : option R) (d : R) : Prop := match b with Some b => d < b | None => True end.

Definition until_at (a : R) (b : option R) (P Q : R -> Prop) (t : R) : Prop :=
  (exists u, t + a <= u /\ upto b (u - t) /\ Q u /\ forall v, t <= v < u -> P v) \/
  (exists u e, 0 < e /\ t + a <= u /\ below b (u - t) /\ (forall v, u < v < u + e -> Q v) /\
     forall v, t <= v <= u -> P v).

Lemma until_more : forall a b (P Q P' Q' : R -> Prop) t,
  (forall v, P v -> P' v) -> (forall v, Q v -> Q' v) -> until_at a b P Q t -> until_at a b P' Q' t.
Proof.
  intros a b P Q P' Q' t HP HQ [(u & A & B & C & D) | (u & e & E & A & B & C & D)].
  - left; exists u; repeat split; auto.
  - right; exists u, e; repeat split; auto.
Qed.

Inductive timed :=
  | Holds (p : nat) | Top | Not (f : timed) | And (f g : timed)
  | Until (window : option (R * option R)) (f g : timed).

Definition low (w : option (R * option R)) : R := match w with Some (a, _) => a | None => 0 end.
Definition high (w : option (R * option R)) : option R :=
  match w with Some (_, b) => b | None => None end.

(** Bounds are not negative, and in order. *)
Fixpoint written (f : timed) : Prop :=
  match f with
  | Holds _ | Top => True
  | Not g => written g
  | And g h => written g /\ written h
  | Until w g h => 0 <= low w /\ upto (high w) (low w) /\ written g /\ written h
  end.

Fixpoint sat (shows : nat -> R -> Prop) (f : timed) (t : R) : Prop :=
  match f with
  | Holds p => shows p t
  | Top => True
  | Not g => ~ sat shows g t
  | And g h => sat shows g t /\ sat shows h t
  | Until w g h => until_at (low w) (high w) (sat shows g) (sat shows h) t
  end.

(** ** What surely holds

    [T] is when the first clock may show the flight's end.  Operators with an end see nothing after
    it.  What they say at its time they say from then on. *)

Section Surely.
  Variable shows : nat -> R -> Prop.
  Variables holds fails : nat -> R -> Prop.
  Variable T : R.
  Hypothesis holds_so : forall p t, holds p t -> shows p t.
  Hypothesis fails_so : forall p t, fails p t -> ~ shows p t.
  Hypothesis holds_on : forall p t u, T <= t -> t <= u -> holds p t -> holds p u.
  Hypothesis fails_on : forall p t u, T <= t -> t <= u -> fails p t -> fails p u.

  Definition seen (w : option (R * option R)) (P : R -> Prop) (t : R) : Prop :=
    P t /\ (high w <> None -> t <= T).

  Definition joined (no : bool) (w : option (R * option R)) (P Q : R -> Prop) (t : R) : Prop :=
    if no then ~ until_at (low w) (high w) (fun v => ~ P v) (fun v => ~ Q v) t
    else until_at (low w) (high w) P Q t.

  Fixpoint surely (no : bool) (f : timed) (t : R) : Prop :=
    match f with
    | Holds p => if no then fails p t else holds p t
    | Top => no = false
    | Not g => surely (negb no) g t
    | And g h => if no then surely no g t \/ surely no h t else surely no g t /\ surely no h t
    | Until w g h =>
        let at_time := joined no w (seen w (surely no g)) (seen w (surely no h)) in
        match w with
        | None => at_time t
        | Some _ => (at_time t /\ t <= T - low w) \/ (low w = 0 /\ T < t /\ at_time T)
        end
    end.

  Definition lasts (P : R -> Prop) : Prop := forall t u, T <= t -> t <= u -> P t -> P u.

  (** What is held after the flight goes on to be so. *)
  Lemma until_lasts : forall P Q t u, lasts P -> lasts Q -> T <= t -> t <= u ->
    until_at 0 None P Q t -> until_at 0 None P Q u.
  Proof.
    intros P Q t u LP LQ Tt tu [(w & A & _ & C & D) | (w & e & E & A & _ & C & D)].
    - destruct (Rle_lt_dec u w) as [H|H].
      + left; exists w; repeat split; auto; try lra. intros v V; apply D; lra.
      + left; exists u; repeat split; auto; try lra; [apply (LQ w); auto; lra | intros v V; lra].
    - destruct (Rle_lt_dec u w) as [H|H].
      + right; exists w, e; repeat split; auto; try lra. intros v V; apply D; lra.
      + assert (M : w < w + Rmin e (u - w) / 2 /\ w + Rmin e (u - w) / 2 < w + e /\ w + Rmin e (u - w) / 2 <= u).
        { pose proof (Rmin_l e (u - w)); pose proof (Rmin_r e (u - w)).
          assert (0 < Rmin e (u - w)) by (apply Rmin_glb_lt; lra). lra. }
        left; exists u; repeat split; auto; try lra.
        * apply (LQ (w + Rmin e (u - w) / 2)); try lra. apply C; lra.
        * intros v V; lra.
  Qed.

  (** Some time from t on is one of a set, if an until is to be so. *)
  Lemma until_reached : forall a b P Q t, 0 <= a -> until_at a b P Q t -> exists u, t <= u /\ Q u.
  Proof.
    intros a b P Q t H [(u & A & _ & C & _) | (u & e & E & A & _ & C & _)].
    - exists u; split; auto; lra.
    - exists (u + e / 2); split; [lra | apply C; lra].
  Qed.

  Lemma until_now : forall b (P Q : R -> Prop) t, upto b 0 -> Q t -> until_at 0 b P Q t.
  Proof.
    intros b P Q t B H; left; exists t; repeat split; auto; try lra.
    - unfold upto in *; destruct b; auto; lra.
    - intros v V; lra.
  Qed.

  (** If the negation of Q lasts, and an until fails at one time, it fails later. *)
  Lemma not_until_lasts : forall b P Q t u, upto b 0 -> lasts Q -> T <= t -> t <= u ->
    ~ until_at 0 b (fun v => ~ P v) (fun v => ~ Q v) t ->
    forall P' Q' : R -> Prop, (forall v, T <= v -> Q v -> ~ Q' v) -> ~ until_at 0 b P' Q' u.
  Proof.
    intros b P Q t u B LQ Tt tu N P' Q' HQ U.
    destruct (until_reached 0 b P' Q' u (Rle_refl 0) U) as (w & W & Qw).
    apply N, until_now; auto. intros Qt; apply (HQ w); [lra| apply (LQ t); auto; lra | auto].
  Qed.

  Theorem surely_lasts : forall f no, written f -> lasts (surely no f).
  Proof.
    induction f as [p | | g IH | g IHg h IHh | w g IHg h IHh]; intros no W t u Tt tu S;
      cbn [surely] in *; cbn in W.
    - destruct no; [apply (fails_on p t) | apply (holds_on p t)]; auto.
    - auto.
    - revert S; apply IH; auto.
    - destruct W as [Wg Wh]; destruct no.
      + destruct S as [S|S]; [left; revert S; apply IHg | right; revert S; apply IHh]; auto.
      + destruct S as [Sg Sh]; split; [revert Sg; apply IHg | revert Sh; apply IHh]; auto.
    - destruct W as (A & B & Wg & Wh); destruct w as [[a b]|].
      + cbn [low high] in *. destruct S as [[S L] | (L & H & S)].
        * assert (a = 0 /\ t = T) as [-> ->] by (split; lra).
          destruct (Rle_lt_dec u T) as [H|H].
          -- left; replace u with T by lra; split; auto; lra.
          -- right; auto.
        * right; repeat split; auto; lra.
      + unfold joined in *; cbn [low high] in *.
        assert (LG : lasts (seen None (surely no g))).
        { intros x y X Y [Z _]; split; [apply (IHg no Wg x); auto | intros F; destruct (F eq_refl)]. }
        assert (LH : lasts (seen None (surely no h))).
        { intros x y X Y [Z _]; split; [apply (IHh no Wh x); auto | intros F; destruct (F eq_refl)]. }
        destruct no.
        * apply (not_until_lasts None (seen None (surely true g)) (seen None (surely true h)) t u I LH Tt tu S).
          intros v _ Q N; auto.
        * revert S; apply until_lasts; auto.
  Qed.

  Theorem surely_sound : forall f, written f -> forall t,
    (surely false f t -> sat shows f t) /\ (surely true f t -> ~ sat shows f t).
  Proof.
    induction f as [p | | g IH | g IHg h IHh | w g IHg h IHh]; intros W t; cbn [surely sat].
    - split; auto.
    - split; auto; discriminate.
    - destruct (IH W t) as [Y N]; split; auto.
    - destruct W as [Wg Wh]; destruct (IHg Wg t) as [Yg Ng], (IHh Wh t) as [Yh Nh]; split.
      + intros [A B]; auto.
      + intros [A|B] [C D]; [apply Ng | apply Nh]; auto.
    - destruct W as (A0 & B0 & Wg & Wh); unfold joined.
      assert (G : forall v, (seen w (surely false g) v -> sat shows g v) /\ (sat shows g v -> ~ seen w (surely true g) v)).
      { intros v; destruct (IHg Wg v) as [Y N]; split; [intros [S _]; auto | intros S [F _]; apply N; auto]. }
      assert (H : forall v, (seen w (surely false h) v -> sat shows h v) /\ (sat shows h v -> ~ seen w (surely true h) v)).
      { intros v; destruct (IHh Wh v) as [Y N]; split; [intros [S _]; auto | intros S [F _]; apply N; auto]. }
      assert (Yes : until_at (low w) (high w) (seen w (surely false g)) (seen w (surely false h)) t ->
        until_at (low w) (high w) (sat shows g) (sat shows h) t).
      { apply until_more; intros v; [apply (G v) | apply (H v)]. }
      assert (No : ~ until_at (low w) (high w) (fun v => ~ seen w (surely true g) v) (fun v => ~ seen w (surely true h) v) t ->
        ~ until_at (low w) (high w) (sat shows g) (sat shows h) t).
      { intros N U; apply N; revert U; apply until_more; intros v; [apply (G v) | apply (H v)]. }
      destruct w as [[a b]|]; [|split; auto]. cbn [low high] in *.
      assert (B : a = 0 -> upto b 0) by (intros ->; auto).
      split.
      + intros [[S _] | (-> & L & S)]; auto. specialize (B eq_refl).
        assert (Qt : surely false h T \/ b = None).
        { destruct b as [b|]; auto. left.
          destruct S as [(u & A & C & [D F] & _) | (u & e & E & A & C & D & _)].
          - cbn in F; assert (u <= T) by (apply F; discriminate). replace T with u by lra; auto.
          - destruct (D (u + e / 2)) as [_ F]; [lra|]. cbn in F; assert (u + e / 2 <= T) by (apply F; discriminate). lra. }
        destruct Qt as [Qt | ->].
        * apply until_now; auto. apply IHh; auto. apply (surely_lasts h false Wh T); auto; lra.
        * apply Yes. apply (until_lasts _ _ T); auto; try lra.
          -- intros x y X Y [Z _]; split; [apply (surely_lasts g false Wg x); auto | intros F; destruct (F eq_refl)].
          -- intros x y X Y [Z _]; split; [apply (surely_lasts h false Wh x); auto | intros F; destruct (F eq_refl)].
      + intros [[S _] | (-> & L & S)]; auto. specialize (B eq_refl).
        intros U; destruct (until_reached 0 b _ _ t (Rle_refl 0) U) as (u & A & C).
        apply S, until_now; auto. intros [Q _].
        destruct (IHh Wh u) as [_ N]; apply N; auto. apply (surely_lasts h true Wh T); auto; lra.
  Qed.
End Surely.

(** ** Windows: a robot's letters on the reference clock *)

(** The robot's clock shows [x] when the reference clock shows [u].  Before its flight it is where that begins, after it
    where it ends. *)
Definition shown_at (e stop : R) (w : R * R) (last : bool) (u : R) : Prop :=
  fst w - e <= u /\ (u <= snd w + e \/ last = true).

Theorem windows_shown : forall e stop w last x u, 0 <= u -> Rabs (x - u) <= e -> fst w <= stop ->
  (x <= stop /\ fst w <= Rmax x 0 <= snd w) \/ (stop <= x /\ last = true) -> shown_at e stop w last u.
Proof.
  intros e stop w last x u U X W C; pose proof (Rle_abs (x - u)); pose proof (Rle_abs (- (x - u))) as A.
  rewrite Rabs_Ropp in A; unfold shown_at; destruct C as [[S [L H']] | [S ->]]; [|split; [lra | auto]].
  pose proof (Rmax_l x 0); split; [|left; lra].
  destruct (Rle_lt_dec 0 x); [rewrite Rmax_left in L by lra; lra | rewrite Rmax_right in L by lra; lra].
Qed.

(** After the first clock may show the end no place begins: what is not shown then is not shown later. *)
Theorem windows_close : forall e stop w last t u, fst w <= stop -> stop - e <= t -> t <= u ->
  ~ shown_at e stop w last t -> ~ shown_at e stop w last u.
Proof.
  unfold shown_at; intros e stop w last t u W T tu N [A B]; apply N; split; [lra|].
  destruct B; [left; lra | auto].
Qed.

(** ** Sets of times: spans from one cut to another *)

(** Just before a time, or just after it; never. *)
Definition cut := option (R * bool).
Definition begun (c : cut) (t : R) : Prop :=
  match c with Some (x, false) => x <= t | Some (x, true) => x < t | None => False end.
Definition clt (c d : cut) : Prop :=
  match c, d with
  | Some (x, i), Some (y, j) => x < y \/ (x = y /\ i = false /\ j = true)
  | Some _, None => True
  | None, _ => False
  end.
Definition cle (c d : cut) : Prop := ~ clt d c.

Definition span : Type := cut * cut.
Definition inside (s : list span) (t : R) : Prop :=
  exists p, In p s /\ begun (fst p) t /\ ~ begun (snd p) t.

Ltac cuts := repeat match goal with c : cut |- _ => destruct c as [[? []]|] end; cbn in *.
Ltac rays := cuts; intuition (try discriminate; try lra).

Lemma begun_dec : forall c t, {begun c t} + {~ begun c t}.
Proof.
  intros [[x []]|] t; cbn; [destruct (Rlt_dec x t) | destruct (Rle_dec x t) | right]; auto.
Qed.

Lemma cut_order : forall c d, {clt c d} + {c = d} + {clt d c}.
Proof.
  intros [[x i]|] [[y j]|]; cbn; auto.
  destruct (total_order_T x y) as [[H| ->]|H]; auto. destruct i, j; auto 6.
Qed.

Lemma clt_dec : forall c d, {clt c d} + {~ clt c d}.
Proof.
  intros c d; destruct (cut_order c d) as [[H|H]|H]; [left; auto | right; subst; rays | right; revert H; rays].
Qed.

Lemma clt_trans : forall c d e, clt c d -> clt d e -> clt c e.
Proof. intros c d e; rays. Qed.

Lemma clt_le : forall c d, clt c d -> cle c d.
Proof. unfold cle; intros c d; rays. Qed.

Lemma cle_lt : forall c d e, cle c d -> clt d e -> clt c e.
Proof.
  intros c d e L H; destruct (cut_order c d) as [[A| ->]|A]; auto;
    [apply (clt_trans c d); auto | destruct (L A)].
Qed.

Lemma lt_cle : forall c d e, clt c d -> cle d e -> clt c e.
Proof.
  intros c d e H L; destruct (cut_order d e) as [[A| <-]|A]; auto;
    [apply (clt_trans c d); auto | destruct (L A)].
Qed.

Lemma cle_trans : forall c d e, cle c d -> cle d e -> cle c e.
Proof. intros c d e A B N; apply B, (lt_cle e c); auto. Qed.

Lemma begun_on : forall c t u, begun c t -> t <= u -> begun c u.
Proof. intros c t u; rays. Qed.

Lemma begun_lt : forall c d t, begun c t -> ~ begun d t -> clt c d.
Proof.
  intros c d t A B; destruct (cut_order c d) as [[H|H]|H]; [auto | subst; tauto | exfalso; revert A B H; rays].
Qed.

Lemma begun_le : forall c d t, cle c d -> begun d t -> begun c t.
Proof.
  intros c d t L B; destruct (begun_dec c t) as [A|A]; auto; destruct (L (begun_lt d c t B A)).
Qed.

(** The cut just after a time, and what it says of other cuts. *)
Lemma before_after : forall c t, cle c (Some (t, true)) <-> forall u, t < u -> begun c u.
Proof.
  intros c t; split.
  - intros L u H; apply (begun_le c (Some (t, true))); auto.
  - intros B N; destruct c as [[x i]|]; cbn in N.
    + destruct N as [H|(_ & E & _)]; [|discriminate]. specialize (B ((t + x) / 2)).
      destruct i; cbn in B; assert (t < (t + x) / 2) by lra; specialize (B H0); lra.
    + cbn in B; apply (B (t + 1)); lra.
Qed.

Definition later (c d : cut) : cut := if clt_dec c d then d else c.
Definition sooner (c d : cut) : cut := if clt_dec c d then c else d.
Definition after (c : cut) : cut := match c with Some (x, _) => Some (x, true) | None => None end.
Definition earlier (c : cut) (d : R) : cut := match c with Some (x, i) => Some (x - d, i) | None => None end.

Lemma begun_later : forall c d t, begun (later c d) t <-> begun c t /\ begun d t.
Proof.
  intros c d t; unfold later; destruct (clt_dec c d) as [H|H]; split; try tauto; intros B; split; auto.
  - apply (begun_le c d); auto using clt_le.
  - apply (begun_le d c); auto.
Qed.

Lemma begun_sooner : forall c d t, begun (sooner c d) t <-> begun c t \/ begun d t.
Proof.
  intros c d t; unfold sooner; destruct (clt_dec c d) as [H|H]; split; try tauto; intros [B|B]; auto.
  - apply (begun_le c d); auto using clt_le.
  - apply (begun_le d c); auto.
Qed.

Lemma begun_earlier : forall c d t, begun (earlier c d) t <-> begun c (t + d).
Proof. intros c d t; rays. Qed.

Lemma later_lt : forall c d e, clt (later c d) e <-> clt c e /\ clt d e.
Proof.
  intros c d e; unfold later; destruct (clt_dec c d) as [H|H]; split; try tauto; intros A; split; auto.
  - apply (clt_trans c d); auto.
  - apply (cle_lt d c); auto.
Qed.

Lemma later_le : forall c d e, cle (later c d) e <-> cle c e /\ cle d e.
Proof.
  intros c d e; unfold later; destruct (clt_dec c d) as [H|H]; split; try tauto; intros A; split; auto.
  - apply (cle_trans c d); auto using clt_le.
  - apply (cle_trans d c); auto.
Qed.

(** *** Spans in order and apart *)

Fixpoint apart (s : list span) : Prop :=
  match s with
  | [] => True
  | p :: r => clt (fst p) (snd p) /\ match r with q :: _ => clt (snd p) (fst q) | [] => True end /\ apart r
  end.

Lemma apart_after : forall s p q, apart (p :: s) -> In q s -> clt (snd p) (fst q).
Proof.
  induction s as [|r s IH]; intros p q A I; [destruct I|].
  destruct A as (_ & B & C); destruct I as [<-|I]; auto.
  apply (clt_trans _ (fst r)); auto. destruct C as (D & E). apply (clt_trans _ (snd r)); auto.
  apply IH; auto; cbn; auto.
Qed.

Lemma apart_order : forall s p q, apart s -> In p s -> In q s ->
  p = q \/ clt (snd p) (fst q) \/ clt (snd q) (fst p).
Proof.
  induction s as [|r s IH]; intros p q A I J; [destruct I|].
  destruct I as [<-|I], J as [<-|J]; auto.
  - right; left; apply (apart_after s); auto.
  - right; right; apply (apart_after s); auto.
  - apply IH; auto; destruct A as (_ & _ & A); auto.
Qed.

Lemma apart_long : forall s p, apart s -> In p s -> clt (fst p) (snd p).
Proof.
  induction s as [|r s IH]; intros p A I; [destruct I|].
  destruct A as (B & _ & A), I as [<-|I]; auto.
Qed.

(** If all times just after one are in some spans, one of these holds the first of them. *)
Lemma just_after_span : forall s u e, 0 < e -> (forall v, u < v < u + e -> inside s v) ->
  exists p, In p s /\ cle (fst p) (Some (u, true)) /\ clt (Some (u, true)) (snd p).
Proof.
  induction s as [|p s IH]; intros u e E A.
  - destruct (A (u + e / 2)) as (q & [] & _); lra.
  - assert (Skip : forall e', 0 < e' <= e -> (forall v, u < v < u + e' -> begun (fst p) v -> begun (snd p) v) ->
      exists p0, In p0 (p :: s) /\ cle (fst p0) (Some (u, true)) /\ clt (Some (u, true)) (snd p0)).
    { intros e' E' B; destruct (IH u e') as (q & I & C); [lra| |exists q; cbn; auto].
      intros v V; destruct (A v) as (q & [<-|I] & C & D); [lra | destruct D; apply (B v V C) | exists q; auto]. }
    destruct (clt_dec (Some (u, true)) (fst p)) as [B|B].
    + destruct (fst p) as [[x i]|] eqn:F.
      * cbn in B; destruct B as [B|(_ & G & _)]; [|discriminate].
        apply (Skip (Rmin e (x - u))).
        -- split; [apply Rmin_glb_lt; lra | apply Rmin_l].
        -- intros v V C; pose proof (Rmin_r e (x - u)); destruct i; cbn in C; lra.
      * apply (Skip e); [lra | intros v V []].
    + destruct (clt_dec (Some (u, true)) (snd p)) as [C|C]; [exists p; cbn; auto|].
      apply (Skip e); [lra|]. intros v V _; apply (proj1 (before_after (snd p) u)); [exact C | lra].
Qed.

(** Spans that are apart: who is in some of them all the while is in one. *)
Lemma stays_inside : forall s p t v, apart s -> In p s -> begun (fst p) t -> ~ begun (snd p) t -> t <= v ->
  (forall w, t <= w <= v -> inside s w) -> ~ begun (snd p) v.
Proof.
  intros s p t v A I B N tv All E; destruct (snd p) as [[z k]|] eqn:Z; [|destruct E].
  assert (tz : t <= z) by (destruct k; cbn in N; lra).
  assert (Others : forall q, In q s -> cle (fst q) (Some (z, k)) -> clt (Some (z, k)) (snd q) -> False).
  { intros q J F G; destruct (apart_order s p q A I J) as [->|[H|H]].
    - rewrite Z in G; revert G; destruct k; cbn; intuition (try discriminate; lra).
    - rewrite Z in H; apply F; auto.
    - assert (clt (Some (z, k)) (fst p)) as M by (apply (clt_trans _ (snd q)); auto).
      apply N, (begun_le _ (fst p)); auto using clt_le. }
  destruct k; cbn in E.
  - destruct (just_after_span s z (v - z)) as (q & J & F & G); [lra | intros w W; apply All; lra|].
    apply (Others q); auto.
  - destruct (All z) as (q & J & F & G); [lra|]. apply (Others q); auto.
    + intros H; apply (cle_lt (Some (z, false)) (Some (z, false))) in H; [|unfold cle; cbn; intuition (try discriminate; lra)].
      revert F H; destruct (fst q) as [[x []]|]; cbn; intuition (try discriminate; lra).
    + apply (begun_lt _ _ z); cbn; auto; lra.
Qed.

(** *** Until, from spans of both sides *)

Section UntilSpans.
  Variables (a : R) (b : option R).
  Hypothesis a_there : 0 <= a.
  Hypothesis b_there : upto b a.

  (** From a span of what is held and one of what is reached. *)
  Definition piece (h s : span) : list span :=
    let since := later (fst h) (fst s) in
    if clt_dec (snd h) since then []
    else if clt_dec since (snd s) then
      [(match b with Some b => later (fst h) (earlier since b) | None => fst h end,
        earlier (sooner (snd s) (after (snd h))) a)]
    else [].

  Definition until_spans (H Q : list span) : list span :=
    (if Req_EM_T a 0 then Q else []) ++ flat_map (fun h => flat_map (piece h) Q) H.

  Lemma in_piece : forall h s p, In p (piece h s) ->
    cle (later (fst h) (fst s)) (snd h) /\ clt (later (fst h) (fst s)) (snd s) /\
    p = (match b with Some b => later (fst h) (earlier (later (fst h) (fst s)) b) | None => fst h end,
      earlier (sooner (snd s) (after (snd h))) a).
  Proof.
    intros h s p; unfold piece; destruct (clt_dec _ _); [intros []|].
    destruct (clt_dec _ _); [intros [E|[]]; auto | intros []].
  Qed.

  Lemma piece_sound : forall h s t, inside (piece h s) t -> until_at a b (inside [h]) (inside [s]) t.
  Proof.
    intros [l r] [c d] t (p & I & A & B); apply in_piece in I; cbn [fst snd] in *.
    destruct I as (L & S & ->); cbn [fst snd] in *.
    rewrite begun_earlier, begun_sooner in B.
    assert (Al : begun l t) by (destruct b; [rewrite begun_later in A|]; tauto).
    assert (Ab : match b with Some b => begun (later l c) (t + b) | None => True end).
    { destruct b; auto. rewrite begun_later, begun_earlier in A; tauto. }
    assert (One : forall p u, begun (fst p) u -> ~ begun (snd p) u -> inside [p] u)
      by (intros p u X Y; exists p; cbn; auto).
    destruct (begun_dec (later l c) (t + a)) as [N|N].
    - left; exists (t + a); split; [lra|]; split; [|split].
      + replace (t + a - t) with a by ring; auto.
      + apply begun_later in N; apply One; cbn; tauto.
      + intros v V; apply One; cbn; [apply (begun_on l t); auto; lra|].
        intros R; apply B; right. destruct r as [[z k]|]; cbn in *; [|tauto]. destruct k; lra.
    - assert (Si : exists x i, later l c = Some (x, i)).
      { destruct (later l c) as [[x i]|]; [eauto | destruct S]. }
      destruct Si as (x & i & E); rewrite E in *.
      assert (C : cle c (Some (x, i))).
      { assert (M : cle (later l c) (Some (x, i))) by (rewrite E; unfold cle; destruct i; cbn; intuition (try discriminate; lra)).
        apply later_le in M; tauto. }
      destruct i; cbn [begun] in N.
      + right; exists x, (match d with Some (y, _) => y - x | None => 1 end).
        split; [destruct d as [[y j]|]; cbn in S; [destruct S as [S|(_ & F & _)]; [lra | discriminate] | lra]|].
        split; [lra|]; split; [|split].
        * unfold below; destruct b; auto; cbn in Ab; lra.
        * intros v V; apply One; cbn.
          -- apply (begun_le c (Some (x, true))); auto; cbn; lra.
          -- destruct d as [[y []]|]; cbn; lra || auto.
        * intros v V; apply One; cbn; [apply (begun_on l t); auto; lra|].
          intros R; apply L; destruct r as [[z []]|]; cbn in *; try tauto; [left; lra|].
          destruct (Rle_lt_or_eq_dec z x) as [Z|Z]; [lra | left; lra | right; auto].
      + left; exists x; split; [lra|]; split; [|split].
        * unfold upto; destruct b; auto; cbn in Ab; lra.
        * apply One; cbn; [apply (begun_le c (Some (x, false))); auto; cbn; lra|].
          destruct d as [[y []]|]; cbn in S |- *; intuition (try discriminate; lra).
        * intros v V; apply One; cbn; [apply (begun_on l t); auto; lra|].
          intros R; apply L; destruct r as [[z []]|]; cbn in *; try tauto; left; lra.
  Qed.

  Lemma inside_in : forall s p t, In p s -> inside [p] t -> inside s t.
  Proof. intros s p t I (q & [<-|[]] & A & B); exists p; auto. Qed.

  Theorem until_spans_sound : forall H Q t, inside (until_spans H Q) t -> until_at a b (inside H) (inside Q) t.
  Proof.
    intros H Q t (p & I & A & B); unfold until_spans in I; apply in_app_or in I; destruct I as [I|I].
    - destruct (Req_EM_T a 0) as [->|]; [|destruct I]. apply until_now; auto; exists p; auto.
    - apply in_flat_map in I; destruct I as (h & Ih & I); apply in_flat_map in I; destruct I as (s & Is & I).
      apply (until_more a b (inside [h]) (inside [s])).
      + intros v; apply inside_in; auto.
      + intros v; apply inside_in; auto.
      + apply piece_sound; exists p; auto.
  Qed.

  Lemma in_until : forall H Q h s t, In h H -> In s Q ->
    cle (later (fst h) (fst s)) (snd h) -> clt (later (fst h) (fst s)) (snd s) -> begun (fst h) t ->
    match b with Some b => begun (later (fst h) (fst s)) (t + b) | None => True end ->
    ~ begun (snd s) (t + a) -> ~ begun (after (snd h)) (t + a) -> inside (until_spans H Q) t.
  Proof.
    intros H Q h s t Ih Is L S B C D E.
    exists (match b with Some b => later (fst h) (earlier (later (fst h) (fst s)) b) | None => fst h end,
      earlier (sooner (snd s) (after (snd h))) a); cbn [fst snd]; split; [|split].
    - unfold until_spans; apply in_or_app; right; apply in_flat_map; exists h; split; auto.
      apply in_flat_map; exists s; split; auto; unfold piece.
      destruct (clt_dec (snd h) _) as [N|_]; [destruct (L N)|]. destruct (clt_dec _ (snd s)); [cbn; auto | tauto].
    - destruct b; auto. apply begun_later; split; auto. apply begun_earlier; auto.
    - rewrite begun_earlier, begun_sooner; tauto.
  Qed.

  Theorem until_spans_complete : forall H Q t, apart H ->
    until_at a b (inside H) (inside Q) t -> inside (until_spans H Q) t.
  Proof.
    intros H Q t Ap [(u & A & B & (s & Is & Bs & Ns) & P) | (u & e & E & A & B & C & P)].
    - destruct (Req_EM_T t u) as [<-|tu].
      + exists s; split; [|auto]. unfold until_spans; apply in_or_app; left.
        destruct (Req_EM_T a 0); [auto | lra].
      + destruct (P t) as (h & Ih & Bh & Nh); [lra|].
        assert (Stay : forall v, t <= v < u -> ~ begun (snd h) v).
        { intros v V; apply (stays_inside H h t v); auto; try lra. intros w W; apply P; lra. }
        assert (End : ~ begun (after (snd h)) u).
        { destruct (snd h) as [[z k]|]; cbn; auto. intros Z; apply (Stay ((Rmax t z + u) / 2)).
          - pose proof (Rmax_l t z); assert (Rmax t z < u) by (apply Rmax_lub_lt; lra); lra.
          - pose proof (Rmax_r t z); assert (Rmax t z < u) by (apply Rmax_lub_lt; lra); destruct k; cbn; lra. }
        apply (in_until H Q h s t); auto.
        * apply later_le; split; [apply clt_le, (apart_long H); auto|].
          intros N; apply End, (begun_le _ (fst s)); auto.
          destruct (snd h) as [[z k]|]; [|destruct N]. unfold after, cle.
          destruct (fst s) as [[x i]|]; cbn in *; [|tauto].
          intros M; destruct N as [N|(N & _ & I')], M as [M|(M & J & _)]; try lra; congruence.
        * apply later_lt; split; apply (begun_lt _ _ u); auto. apply (begun_on _ t); auto; lra.
        * unfold upto in B; destruct b; auto. apply (begun_on _ u); [|lra].
          apply begun_later; split; auto. apply (begun_on _ t); auto; lra.
        * intros N; apply Ns, (begun_on _ (t + a)); auto.
        * intros N; apply End, (begun_on _ (t + a)); auto.
    - destruct (P t) as (h & Ih & Bh & Nh); [lra|].
      assert (End : ~ begun (snd h) u).
      { apply (stays_inside H h t u); auto; try lra. }
      destruct (just_after_span Q u e E C) as (s & Is & F & G).
      apply (in_until H Q h s t); auto.
      + apply later_le; split; [apply clt_le, (apart_long H); auto|].
        apply (cle_trans _ (Some (u, true))); auto.
        intros N; apply End. destruct (snd h) as [[z k]|]; cbn in N |- *; [|tauto].
        destruct N as [N|(-> & -> & _)]; [destruct k|]; lra.
      + apply later_lt; split; [|apply (cle_lt _ (Some (u, true))); auto].
        apply (cle_lt _ (Some (u, true))); auto. apply before_after. intros v V; apply (begun_on _ t); auto; lra.
      + unfold below in B; destruct b; auto. apply begun_later; split; [apply (begun_on _ t); auto; lra|].
        apply (proj1 (before_after (fst s) u)); auto; lra.
      + intros N; apply (begun_on _ _ u) in N; [|lra]. revert G N; destruct (snd s) as [[y []]|]; cbn; intuition (try discriminate; lra).
      + intros N; apply End. destruct (snd h) as [[z k]|]; cbn in N |- *; auto. destruct k; lra.
  Qed.

  Theorem until_exact : forall H Q t, apart H ->
    (inside (until_spans H Q) t <-> until_at a b (inside H) (inside Q) t).
  Proof. split; [apply until_spans_sound | apply until_spans_complete; auto]. Qed.
End UntilSpans.

(** *** Times that are in so many spans *)

Fixpoint rising (s : list cut) : Prop :=
  match s with c :: (d :: _) as r => cle c d /\ rising r | _ => True end.

(** Whether an odd number of cuts lies before a time. *)
Fixpoint odd (s : list cut) (t : R) : bool :=
  match s with [] => false | c :: r => xorb (if begun_dec c t then true else false) (odd r t) end.

Fixpoint pairs (s : list cut) : list span :=
  match s with c :: d :: r => (c, d) :: pairs r | [c] => [(c, None)] | [] => [] end.

Lemma rising_tail : forall c s, rising (c :: s) -> rising s.
Proof. intros c [|d s]; cbn; tauto. Qed.

Lemma rising_all : forall s c d, rising (c :: s) -> In d s -> cle c d.
Proof.
  induction s as [|e s IH]; intros c d R I; [destruct I|].
  destruct R as [L R]; destruct I as [<-|I]; auto. apply (cle_trans _ e); auto.
Qed.

Lemma odd_none : forall s t, (forall c, In c s -> ~ begun c t) -> odd s t = false.
Proof.
  induction s as [|c s IH]; intros t H; auto; cbn.
  destruct (begun_dec c t) as [B|B]; [destruct (H c); cbn; auto|]. rewrite IH; auto; intros d D; apply H; cbn; auto.
Qed.

Lemma pairs_after : forall n s d p, (length s <= n)%nat -> rising (d :: s) -> In p (pairs s) -> cle d (fst p).
Proof.
  induction n as [|n IH]; intros s d p L R I; destruct s as [|e [|f s]]; cbn in L; try lia; cbn in I.
  1, 2: destruct I.
  - destruct I as [<-|[]]; apply R.
  - destruct I as [<-|I]; [apply R|]. apply (cle_trans _ f).
    + apply (rising_all (e :: f :: s)); cbn; auto.
    + apply (IH s f); auto; [lia|]. apply (rising_tail e), (rising_tail d), R.
Qed.

Lemma pairs_inside : forall n s t, (length s <= n)%nat -> rising s -> (inside (pairs s) t <-> odd s t = true).
Proof.
  induction n as [|n IH]; intros s t L R; destruct s as [|c [|d s]]; cbn in L; try lia.
  1, 2: cbn; split; [intros (p & [] & _) | discriminate].
  - cbn; destruct (begun_dec c t) as [B|B]; split; auto; try discriminate.
    + intros _; exists (c, None); cbn; auto.
    + intros (p & [<-|[]] & A & _); destruct (B A).
  - pose proof (rising_tail c (d :: s) R) as Rd; pose proof (rising_tail d s Rd) as Rs.
    specialize (IH s t); cbn [pairs odd]. destruct (begun_dec d t) as [D|D].
    + assert (C : begun c t) by (apply (begun_le c d); auto; apply R).
      destruct (begun_dec c t) as [_|N]; [|destruct (N C)].
      replace (xorb true (xorb true (odd s t))) with (odd s t) by (destruct (odd s t); auto).
      rewrite <- IH by (auto; lia). split; [intros (p & [<-|I] & A & B) | intros (p & I & A)].
      * destruct (B D).
      * exists p; auto.
      * exists p; cbn; auto.
    + rewrite (odd_none s t); [|intros e E F; apply D, (begun_le d e); auto; apply (rising_all s); auto].
      destruct (begun_dec c t) as [C|C]; cbn; split; auto; try discriminate.
      * intros _; exists (c, d); cbn; auto.
      * intros (p & [<-|I] & A & B); [destruct (C A)|].
        exfalso; apply D, (begun_le d (fst p)); auto. apply (pairs_after (length s) s); auto.
Qed.

(** Steps by cuts: how many spans more begin at each than end. *)
Fixpoint add (c : cut) (n : Z) (s : list (cut * Z)) : list (cut * Z) :=
  match s with
  | [] => [(c, n)]
  | (d, m) :: r =>
      match cut_order c d with
      | inleft (left _) => (c, n) :: s
      | inleft (right _) => (d, (m + n)%Z) :: r
      | inright _ => (d, m) :: add c n r
      end
  end.

Definition steps (spans : list span) : list (cut * Z) :=
  fold_right (fun p s => add (fst p) 1 (add (snd p) (-1) s)) [] spans.

Definition one_if (c : cut) (t : R) : Z := if begun_dec c t then 1 else 0.

Fixpoint total (s : list (cut * Z)) (t : R) : Z :=
  match s with [] => 0 | (c, n) :: r => one_if c t * n + total r t end.

(** How many spans a time is in; one that ends before it begins takes one away. *)
Definition count (spans : list span) (t : R) : Z :=
  fold_right (fun p n => (one_if (fst p) t - one_if (snd p) t + n)%Z) 0%Z spans.

Lemma add_total : forall c n s t, total (add c n s) t = (one_if c t * n + total s t)%Z.
Proof.
  induction s as [|[d m] s IH]; intros t; cbn [add]; [reflexivity|].
  destruct (cut_order c d) as [[H|H]|H]; cbn [total]; auto; [subst; lia | rewrite IH; lia].
Qed.

Lemma steps_total : forall spans t, total (steps spans) t = count spans t.
Proof.
  induction spans as [|p s IH]; intros t; auto. unfold steps, count; cbn [fold_right].
  fold (steps s) (count s t). rewrite !add_total, IH; lia.
Qed.

Fixpoint in_order (s : list (cut * Z)) : Prop :=
  match s with [] => True | (c, _) :: r => (forall d, In d r -> clt c (fst d)) /\ in_order r end.

Lemma in_add : forall c n s d, In d (add c n s) -> fst d = c \/ exists e, In e s /\ fst d = fst e.
Proof.
  induction s as [|[e m] s IH]; intros d I; cbn [add] in I.
  - destruct I as [<-|[]]; auto.
  - destruct (cut_order c e) as [[H|H]|H].
    + destruct I as [<-|I]; eauto.
    + destruct I as [<-|I]; [subst; auto | right; exists d; cbn; auto].
    + destruct I as [<-|I]; [right; exists (e, m); cbn; auto|].
      destruct (IH d I) as [E|(f & F & E)]; eauto. right; exists f; cbn; auto.
Qed.

Lemma add_order : forall c n s, in_order s -> in_order (add c n s).
Proof.
  induction s as [|[d m] s IH]; intros O; cbn [add].
  - cbn; split; auto; intros e [].
  - destruct O as [A O]; destruct (cut_order c d) as [[H|H]|H].
    + cbn; split; [|split; auto]. intros e [<-|I]; auto. apply (clt_trans _ d); auto.
    + split; auto.
    + split; auto. intros e I; destruct (in_add c n s e I) as [->|(f & F & ->)]; auto.
Qed.

Lemma steps_order : forall spans, in_order (steps spans).
Proof. induction spans as [|p s IH]; [exact I|]. apply add_order, add_order, IH. Qed.

(** Cuts at which the number comes to enough, or ceases to be enough. *)
Fixpoint sweep (least n : Z) (on : bool) (s : list (cut * Z)) : list cut :=
  match s with
  | [] => []
  | (c, m) :: r =>
      let now := (n + m)%Z in
      if Bool.eqb (least <=? now)%Z on then sweep least now on r else c :: sweep least now (negb on) r
  end.

Definition within (spans : list span) (least : Z) : list span :=
  if (least <=? 0)%Z then [(Some (0, false), None)] else pairs (sweep least 0 false (steps spans)).

Lemma in_sweep : forall least s n on c, In c (sweep least n on s) -> exists d, In d s /\ fst d = c.
Proof.
  induction s as [|[d m] s IH]; intros n on c I; cbn in I; [destruct I|].
  destruct (Bool.eqb _ on); [|destruct I as [<-|I]; [exists (d, m); cbn; auto|]];
    destruct (IH _ _ _ I) as (e & E & F); exists e; cbn; auto.
Qed.

Lemma none_begun : forall s c m t, in_order ((c, m) :: s) -> ~ begun c t -> total s t = 0%Z.
Proof.
  induction s as [|[d k] s IH]; intros c m t O B; auto. destruct O as [A O].
  assert (D : ~ begun d t) by (intros D; apply B, (begun_le c d); auto; apply clt_le, (A (d, k)); cbn; auto).
  cbn; unfold one_if; destruct (begun_dec d t) as [E|_]; [destruct (D E)|]. rewrite (IH d k); auto.
Qed.

Lemma sweep_odd : forall least s n on t, in_order s -> on = (least <=? n)%Z ->
  xorb on (odd (sweep least n on s) t) = (least <=? n + total s t)%Z.
Proof.
  induction s as [|[c m] s IH]; intros n on t O E; cbn [sweep total].
  - cbn; rewrite Z.add_0_r, <- E; destruct on; auto.
  - destruct (begun_dec c t) as [B|B].
    + replace (n + (one_if c t * m + total s t))%Z with (n + m + total s t)%Z
        by (unfold one_if; destruct (begun_dec c t); [lia | tauto]).
      destruct (Bool.eqb (least <=? n + m)%Z on) eqn:Q.
      * apply Bool.eqb_prop in Q; rewrite <- IH with (on := on); auto. apply O.
      * cbn [odd]; destruct (begun_dec c t) as [_|N]; [|tauto].
        rewrite <- IH with (on := negb on); [destruct on; cbn; destruct (odd _ t); auto | apply O|].
        destruct (least <=? n + m)%Z, on; cbn in Q; auto; discriminate.
    + assert (Z0 : total s t = 0%Z) by (apply (none_begun s c m); auto).
      replace (n + (one_if c t * m + total s t))%Z with n
        by (unfold one_if; destruct (begun_dec c t); [tauto | lia]).
      rewrite <- E. rewrite odd_none; [destruct on; auto|].
      intros d D F; apply B. destruct O as [A O].
      destruct (Bool.eqb _ on); [|destruct D as [<-|D]; auto];
        destruct (in_sweep _ _ _ _ _ D) as (e & I & <-); apply (begun_le c (fst e)); auto using clt_le.
Qed.

Fixpoint strict (s : list cut) : Prop :=
  match s with c :: (d :: _) as r => clt c d /\ strict r | _ => True end.

Lemma strict_rising : forall s, strict s -> rising s.
Proof.
  induction s as [|c [|d s] IH]; cbn [strict rising]; auto.
  intros [L S]; split; [apply clt_le; auto | apply IH, S].
Qed.

Lemma sweep_strict : forall least s n on, in_order s -> strict (sweep least n on s).
Proof.
  induction s as [|[c m] s IH]; intros n on O; cbn [sweep]; [exact I|]. destruct O as [A O].
  destruct (Bool.eqb _ on); auto.
  assert (H : strict (sweep least (n + m) (negb on) s)) by auto.
  destruct (sweep least (n + m) (negb on) s) as [|d r] eqn:E; [exact I|]. split; auto.
  destruct (in_sweep least s (n + m)%Z (negb on) d) as (e & J & <-); [rewrite E; cbn; auto | auto].
Qed.

Lemma sweep_rising : forall least s n on, in_order s -> rising (sweep least n on s).
Proof. intros; apply strict_rising, sweep_strict; auto. Qed.

Theorem within_exact : forall spans least t, 0 <= t -> (0 < least)%Z \/ (0 <= count spans t)%Z ->
  (inside (within spans least) t <-> (least <= count spans t)%Z).
Proof.
  intros spans least t T N; unfold within; destruct (least <=? 0)%Z eqn:L.
  - apply Z.leb_le in L; split; [lia|]. intros _; exists (Some (0, false), None); cbn; auto.
  - apply Z.leb_gt in L. rewrite (pairs_inside _ _ _ (le_n _)) by (apply sweep_rising, steps_order).
    pose proof (sweep_odd least (steps spans) 0 false t (steps_order spans)) as S.
    rewrite steps_total in S.
    assert (S' : odd (sweep least 0 false (steps spans)) t = (least <=? count spans t)%Z).
    { rewrite <- Z.add_0_l with (n := count spans t). rewrite <- S; [destruct (odd _ t); auto|]. symmetry; apply Z.leb_gt; auto. }
    rewrite S'; apply Z.leb_le.
Qed.

(** *** What comes out is in order and apart *)

Definition ends_of (spans : list span) : list cut := flat_map (fun p => [fst p; snd p]) spans.

Lemma pairs_apart : forall n s, (length s <= n)%nat -> Nat.even (length s) = true -> strict s -> apart (pairs s).
Proof.
  induction n as [|n IH]; intros s L E S; destruct s as [|c [|d s]]; cbn in L; try lia; try exact I; try discriminate.
  destruct S as [H S]. destruct s as [|e [|f s]]; [cbn; auto | cbn in E; discriminate|].
  destruct S as [K S]. split; [exact H|]. split; [exact K|]. apply (IH (e :: f :: s)); auto; cbn in *; lia.
Qed.

Fixpoint sum (s : list (cut * Z)) : Z := match s with [] => 0 | (_, m) :: r => m + sum r end.

Lemma add_sum : forall c n s, sum (add c n s) = (n + sum s)%Z.
Proof.
  induction s as [|[d m] s IH]; cbn [add]; [reflexivity|].
  destruct (cut_order c d) as [[H|H]|H]; cbn [sum]; try lia; rewrite IH; lia.
Qed.

Lemma steps_sum : forall spans, sum (steps spans) = 0%Z.
Proof.
  induction spans as [|p s IH]; auto. unfold steps; cbn [fold_right]; fold (steps s).
  rewrite !add_sum, IH; reflexivity.
Qed.

Lemma sweep_even : forall least s n on, on = (least <=? n)%Z ->
  Nat.even (length (sweep least n on s)) = Bool.eqb on (least <=? n + sum s)%Z.
Proof.
  induction s as [|[c m] s IH]; intros n on E; cbn [sweep sum].
  - rewrite Z.add_0_r, <- E; destruct on; auto.
  - rewrite Z.add_assoc. destruct (Bool.eqb (least <=? n + m)%Z on) eqn:Q.
    + apply Bool.eqb_prop in Q; apply IH; auto.
    + cbn [length]. rewrite Nat.even_succ, <- Nat.negb_even, (IH (n + m)%Z (negb on)).
      * destruct on, (least <=? n + m + sum s)%Z; auto.
      * destruct (least <=? n + m)%Z, on; cbn in Q; auto; discriminate.
Qed.

Theorem within_apart : forall spans least, apart (within spans least).
Proof.
  intros spans least; unfold within; destruct (least <=? 0)%Z eqn:L; [cbn; auto|].
  apply (pairs_apart _ _ (le_n _)); [|apply sweep_strict, steps_order].
  rewrite sweep_even by (symmetry; auto). rewrite steps_sum, Z.add_0_r, L; auto.
Qed.

(** *** All other times *)

Definition without (s : list span) : list span :=
  filter (fun p => if clt_dec (fst p) (snd p) then true else false) (pairs (Some (0, false) :: ends_of s)).

Lemma pairs_ends : forall s, pairs (ends_of s) = s.
Proof. induction s as [|[c d] s IH]; auto. unfold ends_of in *; cbn in *; rewrite IH; auto. Qed.

Lemma ends_rising : forall s, apart s -> rising (ends_of s).
Proof.
  induction s as [|p s IH]; intros A; [exact I|]. destruct A as (B & C & A). specialize (IH A).
  unfold ends_of in *; cbn [flat_map app]. split; [apply clt_le; auto|].
  destruct s as [|q s]; [exact I|]. cbn [flat_map app] in *; split; [apply clt_le|]; auto.
Qed.

Theorem without_exact : forall s t, 0 <= t -> apart s -> (forall p, In p s -> cle (Some (0, false)) (fst p)) ->
  (inside (without s) t <-> ~ inside s t).
Proof.
  intros s t T A B.
  assert (R : rising (Some (0, false) :: ends_of s)).
  { pose proof (ends_rising s A). destruct s as [|p s]; [exact I|]. split; auto. apply B; cbn; auto. }
  assert (F : inside (without s) t <-> inside (pairs (Some (0, false) :: ends_of s)) t).
  { unfold without; split; intros (p & I & C & D).
    - apply filter_In in I; exists p; tauto.
    - exists p; split; auto. apply filter_In; split; auto.
      destruct (clt_dec (fst p) (snd p)) as [_|N]; auto. destruct N; apply (begun_lt _ _ t); auto. }
  rewrite F, (pairs_inside _ _ _ (le_n _)) by auto.
  rewrite <- (pairs_ends s) at 2. rewrite (pairs_inside _ _ _ (le_n _)) by (apply ends_rising; auto).
  cbn [odd]. destruct (begun_dec (Some (0, false)) t) as [_|N]; [|cbn in N; tauto].
  destruct (odd (ends_of s) t); cbn; split; auto; discriminate || (intros H; destruct H; auto).
Qed.
